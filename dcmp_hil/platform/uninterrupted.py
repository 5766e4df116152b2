"""Work that no signal handler interrupts: it is done as a whole, or not at all.

Python calls the handlers of signals in the main thread, between any two of its steps. A handler that raises,
as that of Ctrl-C does, cuts work in two there: `subprocess.Popen` forgets a process that it has started.
"""

from __future__ import annotations

import _thread
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class UninterruptedWork:
    """A function that is called on a thread of its own, where no signal handler runs.

    The thread and its locks are the plain ones: a handler that raises in `threading.Event` or in
    `threading.Thread.start` leaves a lock taken for ever.

    Parameters
    ----------
    work
        The function; called at most once.
    """

    def __init__(self, work: Callable[[], None]) -> None:
        self._work: Callable[[], None] | None = work
        self._gate = _thread.allocate_lock()  # taken while the function runs
        self._done = _thread.allocate_lock()  # taken until it has run
        self._done.acquire()
        self._cancelled = False
        self._error: BaseException | None = None

    def do(self) -> None:
        """Call the function, and wait until it has returned; raise what it raises.

        Raises
        ------
        OSError
            If the system gives no thread.
        """
        try:
            _thread.start_new_thread(self._run, ())
        except RuntimeError as error:
            raise OSError(str(error)) from error
        self._done.acquire()
        failed, self._error = self._error, None
        try:
            if failed is not None:
                raise failed
        finally:
            del failed  # its traceback refers to this frame

    def settle(self) -> None:
        """Wait for the end of the function if it has begun, and keep it from beginning if it has not.

        For the caller whose `do` was interrupted.
        """
        with self._gate:
            self._cancelled = True

    def _run(self) -> None:
        with self._gate:
            if not self._cancelled and self._work is not None:
                try:
                    self._work()
                except BaseException as error:  # noqa: BLE001 - raised by `do`
                    self._error = error
            self._work = None  # what it holds is the caller's alone before the caller goes on
        self._done.release()
