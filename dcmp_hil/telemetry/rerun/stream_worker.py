"""A stream with a thread of its own: a call to Rerun never returns when the other end is frozen."""

from __future__ import annotations

import os
import threading
import weakref
from contextlib import suppress
from pathlib import Path
from queue import Empty, Full, Queue
from typing import TYPE_CHECKING

from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.disk_space import room_for, size_of

if TYPE_CHECKING:
    from collections.abc import Callable

    import rerun as rr

    Job = Callable[[rr.RecordingStream], None]

THREAD = "rerun"
"""Name of the threads: one that is still there after `close` is stuck for good."""
_JOBS_MAX = 32  # jobs; 3 s of a run in real time
_POLL_PERIOD_S = 0.05  # s
_FLUSH_TIMEOUT_S = 5.0  # s
_STALL_TIMEOUT_S = 4.0  # s that a file does not grow in a run while it is flushed
_FULL_DISK_STALL_TIMEOUT_S = 1.5  # s where there is no room: that flush may wait for ever
_FREE_BYTES_MIN = 1 << 20  # bytes


def _no_farewell() -> None:
    """Leave at once."""


class StreamWorker:
    """Does jobs with a stream, in order, on a thread that may get stuck without harm to other threads.

    Parameters
    ----------
    stream
        Used by this object only from now on.
    patience
        s that `do` waits when the thread is behind.
    ending
        s that `close` waits at most.
    file
        What the stream is written to. It is flushed after every job, which raises where what was written is
        lost; None for a viewer, which is not.

    Attributes
    ----------
    farewell
        Called between the last job and the end of the stream.
    """

    def __init__(
        self, stream: rr.RecordingStream, patience: float, ending: float, *, file: Path | None = None
    ) -> None:
        self.farewell: Callable[[], None] = _no_farewell
        self._stream = stream
        self._patience = patience
        self._ending = ending
        self.file = file
        self._opened: int | None = None  # its descriptor: a file may get another name
        if file is not None:
            with suppress(OSError):
                self._opened = os.open(file, os.O_RDONLY)
                weakref.finalize(self, os.close, self._opened)
        self._jobs: Queue[Job | None] = Queue(_JOBS_MAX)
        self._error: Exception | None = None
        self._clock = MonotonicClock()
        self._began_ns = self._grew_ns = 0  # the job at hand, 0 for none; when the file was seen to grow
        self._size = 0  # bytes of the file
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=THREAD, daemon=True)
        self._thread.start()

    def size(self) -> int:
        """Return the bytes of the file, under the name that it has by now; 0 for a viewer."""
        if self._opened is not None:
            return os.fstat(self._opened).st_size
        return 0 if self.file is None else size_of(self.file)

    def written(self) -> Path | None:
        """Return the file by the name that it has by now; None for a viewer."""
        if self._opened is None:
            return self.file
        try:
            return Path(f"/proc/self/fd/{self._opened}").readlink()
        except OSError:  # not Linux
            return self.file

    @property
    def stalled(self) -> float:
        """Time (s) for which the file has not grown during a job; 0 for a viewer."""
        began_ns, now_ns = self._began_ns, self._clock.now_ns()
        if self.file is None or not began_ns:
            return 0.0
        size = self.size()
        if size != self._size:
            self._size, self._grew_ns = size, now_ns
        return 1e-9 * (now_ns - max(began_ns, self._grew_ns))

    def _stalls(self, patience: float) -> bool:
        stalled = self.stalled
        return stalled > patience or (
            stalled > _FULL_DISK_STALL_TIMEOUT_S
            and self.file is not None
            and room_for(self.file) < _FREE_BYTES_MIN
        )

    def do(self, job: Job) -> bool:
        """Queue `job`; return False if there was no room within `patience`.

        Raises
        ------
        Exception
            The exception that an earlier job raised.
        """
        self._raise_what_was_raised()
        if self._stalls(_STALL_TIMEOUT_S):
            return False
        try:
            self._jobs.put(job, timeout=self._patience)
        except Full:
            return False
        return True

    def settle(self, within: float) -> bool:
        """Wait until what was given to do is done; False if that takes longer than `within` (s), or is stuck.

        Raises
        ------
        Exception
            The exception that a job raised.
        """
        end_ns = self._clock.now_ns() + int(within * 1e9)
        done = threading.Event()
        if not self.do(lambda _: done.set()):
            return False
        while not done.wait(_POLL_PERIOD_S):
            if self._stalls(_STALL_TIMEOUT_S) or self._clock.now_ns() >= end_ns:
                return False
        self._raise_what_was_raised()
        return True

    def close(self, within: float) -> None:
        """End the stream after the last job; wait for it so many seconds, or those of `ending`.

        Calling it again waits again.

        Raises
        ------
        Exception
            The exception that an earlier job raised.
        TimeoutError
            If a file is not finished by then.
        """
        within = 0.0 if self._stalls(self._ending) else min(within, self._ending)
        end_ns = self._clock.now_ns() + int(within * 1e9)
        with suppress(Full):
            self._jobs.put(None, timeout=within)
            while (
                not self._ended.is_set() and not self._stalls(self._ending) and self._clock.now_ns() < end_ns
            ):
                self._ended.wait(min(_POLL_PERIOD_S, max(0, end_ns - self._clock.now_ns()) * 1e-9))
        self._raise_what_was_raised()
        if self.file is not None and not self._ended.is_set():
            stalled = self.stalled
            raise TimeoutError(
                f"it did not grow for {stalled:.1f} s"
                if self._clock.now_ns() < end_ns or stalled > 0.5 * within
                else f"it was still being written {within:.1f} s after the end"
            )

    def leave(self) -> None:
        """End the stream after the last job, and wait for nothing."""
        with suppress(Full):
            self._jobs.put_nowait(None)

    def drop(self) -> None:
        """End the stream after the job at hand, leave the others out, and wait for nothing.

        Where the producer is much faster than the disk, what waits is megabytes.
        """
        with suppress(Empty):
            while True:
                self._jobs.get_nowait()
        self.leave()

    def _serve(self) -> None:
        while (job := self._jobs.get()) is not None:
            self._began_ns = self._clock.now_ns()
            try:
                job(self._stream)
                if self.file is not None:
                    self._stream.flush(timeout_sec=_FLUSH_TIMEOUT_S)
            except Exception as error:  # noqa: BLE001 - raised to the caller of the next job
                self._error = error
            self._began_ns = 0
        self._began_ns = self._clock.now_ns()
        try:
            self._stream.flush(timeout_sec=_FLUSH_TIMEOUT_S)
        except Exception as error:  # noqa: BLE001 - a full disk or a frozen viewer
            self._error = error if self.file is not None else self._error
            self._ended.set()
            threading.Event().wait()  # to leave would end the stream, which waits for the disk for ever
        self.farewell()
        self._stream.disconnect()
        self._ended.set()

    def _raise_what_was_raised(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error
