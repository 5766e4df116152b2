"""The end of a command's process: nothing that a class of the user's own left behind holds it up."""

from __future__ import annotations

import os
import sys
import threading

from dcmp_hil.cli import console
from dcmp_hil.telemetry.rerun.stream_worker import THREAD


def leave(code: int) -> None:
    """End the process with `code`, if something would hold it up; otherwise return.

    Threads and processes that a class of the user's own has started would be waited for, without end; so
    would Rerun's own ending, for a viewer that is frozen.
    """
    main = threading.main_thread()
    threads = [thread for thread in threading.enumerate() if thread is not main and not thread.daemon]
    workers = _workers()
    if not threads and not workers and not any(thread.name == THREAD for thread in threading.enumerate()):
        return
    if workers:
        console.warn(f"Processes that a class of your own has started were ended: {workers}.")
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    os._exit(code)


def _workers() -> int:
    """End processes of `multiprocessing`, where it is in use; return how many there were."""
    module = sys.modules.get("multiprocessing")
    workers = module.active_children() if module is not None else []
    for worker in workers:
        worker.terminate()
    return len(workers)
