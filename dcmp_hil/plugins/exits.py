"""A class of the user's own that ends the process: an end of the run with a name, and not a silent one."""

from __future__ import annotations

import os
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from collections.abc import Iterator


class ProcessExit(SystemExit):
    """Exception that `os._exit` and `os.abort` raise during a run, which they would end without a report."""


@contextmanager
def exits_named() -> Iterator[None]:
    """Turn calls of `os._exit` and `os.abort` in this thread into exceptions; a fork makes them as ever.

    Another thread ends the process all the same, with an exit code that is not 0.
    """
    leave, abort = os._exit, os.abort
    here, pid = threading.current_thread(), os.getpid()

    def named_exit(status: int) -> NoReturn:
        if os.getpid() != pid:
            leave(status)
        if threading.current_thread() is not here:
            leave(status or 1)
        raise ProcessExit(f"os._exit({status}) would end the process")

    def named_abort() -> NoReturn:
        if os.getpid() != pid or threading.current_thread() is not here:
            abort()
        raise ProcessExit("os.abort() would end the process")

    os._exit, os.abort = named_exit, named_abort
    try:
        yield
    finally:
        os._exit, os.abort = leave, abort
