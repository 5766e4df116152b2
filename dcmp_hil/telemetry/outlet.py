"""A stream with a thread of its own: a call to Rerun never returns when the other end is frozen."""

from __future__ import annotations

import threading
from contextlib import suppress
from queue import Full, Queue
from typing import TYPE_CHECKING

from dcmp_hil.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Callable

    import rerun as rr

    Job = Callable[[rr.RecordingStream], None]

THREAD = "rerun"
"""Name of the threads: one that is still there after `close` is stuck for good."""
_WAITING = 32  # jobs; 3 s of a run in real time
_FLUSH = 5.0  # s


def _no_farewell() -> None:
    """Leave at once."""


class Outlet:
    """Does jobs with a stream, in order, on a thread that may get stuck without harm to anybody.

    Parameters
    ----------
    stream
        Nobody else uses it from now on.
    patience
        s that `do` waits when the thread is behind.
    ending
        s that `close` waits at most.

    Attributes
    ----------
    farewell
        Called between the last job and the end of the stream.
    """

    def __init__(self, stream: rr.RecordingStream, patience: float, ending: float) -> None:
        self.farewell: Callable[[], None] = _no_farewell
        self._stream = stream
        self._patience = patience
        self._ending = ending
        self._jobs: Queue[Job | None] = Queue(_WAITING)
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._serve, name=THREAD, daemon=True)
        self._thread.start()

    def do(self, job: Job) -> bool:
        """Put `job` behind those that wait; False if there was no room in all the time of `patience`.

        Raises
        ------
        Exception
            Whatever an earlier job raised.
        """
        self._raise_what_was_raised()
        try:
            self._jobs.put(job, timeout=self._patience)
        except Full:
            return False
        return True

    def close(self, within: float) -> None:
        """End the stream after the last job; wait for it so many seconds, or those of `ending`.

        Calling it again waits again.

        Raises
        ------
        Exception
            Whatever an earlier job raised.
        """
        within = min(within, self._ending)
        clock = MonotonicClock()
        end_ns = clock.now_ns() + int(within * 1e9)
        with suppress(Full):
            self._jobs.put(None, timeout=within)
            self._thread.join(max(0, end_ns - clock.now_ns()) * 1e-9)
        self._raise_what_was_raised()

    def _serve(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job(self._stream)
            except Exception as error:  # noqa: BLE001 - told to whoever brings the next job
                self._error = error
        try:
            self._stream.flush(timeout_sec=_FLUSH)
        except Exception:  # noqa: BLE001 - a full disk or a frozen viewer: disconnecting would wait for ever
            return
        self.farewell()
        self._stream.disconnect()

    def _raise_what_was_raised(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error
