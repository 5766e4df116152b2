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
_LOOK = 0.05  # s
_FLUSH = 5.0  # s
_STALL, _LAST_STALL = 4.0, 1.5  # s, in a run and at its end: a full disk may leave a flush waiting for ever


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
    flushes
        Whether to flush after every job, which raises where what was written is lost.

    Attributes
    ----------
    farewell
        Called between the last job and the end of the stream.
    """

    def __init__(
        self, stream: rr.RecordingStream, patience: float, ending: float, *, flushes: bool = False
    ) -> None:
        self.farewell: Callable[[], None] = _no_farewell
        self._stream = stream
        self._patience = patience
        self._ending = ending
        self._flushes = flushes
        self._jobs: Queue[Job | None] = Queue(_WAITING)
        self._error: Exception | None = None
        self._clock = MonotonicClock()
        self._began_ns = 0  # the job at hand; 0 for none
        self._thread = threading.Thread(target=self._serve, name=THREAD, daemon=True)
        self._thread.start()

    def _stalls(self, patience: float) -> bool:
        """Tell whether what is flushed after every job has waited for that for `patience` (s)."""
        began_ns = self._began_ns
        return self._flushes and began_ns > 0 and self._clock.now_ns() - began_ns > patience * 1e9

    def do(self, job: Job) -> bool:
        """Put `job` behind those that wait; False if there was no room in all the time of `patience`.

        Raises
        ------
        Exception
            Whatever an earlier job raised.
        """
        self._raise_what_was_raised()
        if self._stalls(_STALL):
            return False
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
        within = 0.0 if self._stalls(_LAST_STALL) else min(within, self._ending)
        end_ns = self._clock.now_ns() + int(within * 1e9)
        with suppress(Full):
            self._jobs.put(None, timeout=within)
            while self._thread.is_alive() and self._clock.now_ns() < end_ns and not self._stalls(_LAST_STALL):
                self._thread.join(min(_LOOK, max(0, end_ns - self._clock.now_ns()) * 1e-9))
        self._raise_what_was_raised()
        if self._stalls(_LAST_STALL):
            raise TimeoutError("the disk takes nothing any more")

    def leave(self) -> None:
        """End the stream after the last job, and wait for nothing."""
        with suppress(Full):
            self._jobs.put_nowait(None)

    def _serve(self) -> None:
        while (job := self._jobs.get()) is not None:
            self._began_ns = self._clock.now_ns()
            try:
                job(self._stream)
                if self._flushes:
                    self._stream.flush(timeout_sec=_FLUSH)
            except Exception as error:  # noqa: BLE001 - told to whoever brings the next job
                self._error = error
            self._began_ns = 0
        self._began_ns = self._clock.now_ns()
        try:
            self._stream.flush(timeout_sec=_FLUSH)
        except Exception as error:  # noqa: BLE001 - a full disk or a frozen viewer: disconnecting waits for ever
            self._error = error if self._flushes else self._error
            return
        self.farewell()
        self._stream.disconnect()

    def _raise_what_was_raised(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error
