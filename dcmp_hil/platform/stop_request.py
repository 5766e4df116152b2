"""External end of a run: Ctrl-C, signals and STOP become a request that the loop reads once a cycle.

A class of the user's own runs in the same process and may set signal handlers too, as libraries do. While
a run goes on its signals are the run's: `signal.signal` leaves these three alone, and `reinstall` puts back
what was replaced in other ways.
"""

from __future__ import annotations

import os
import signal
import threading
import weakref
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Self

from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType, TracebackType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""What ends a run."""
TAKEN_FLAG = 0x80
"""Added to the number of a signal where Python has handled it, and not only the kernel delivered it."""
_STOP = "STOP"
_FOR_EVER_NS = 1 << 63


class Interrupted(KeyboardInterrupt):
    """A second signal: the way out of a stage that hangs. No stage keeps it."""


class StopRequest:
    """Turns SIGINT, SIGTERM and SIGHUP into `requested` while it is entered.

    A second SIGINT, or SIGTERM after SIGINT, raises `Interrupted` at once: the way out of a stage that hangs.
    Outside the main thread, where Python allows no handlers, only `requested` itself works.

    Attributes
    ----------
    requested
        Whether the run is to end.
    signal
        What asked first, if a signal did.
    refused
        Signals for which something else wanted to set a handler, or did.
    """

    def __init__(self) -> None:
        self.requested = False
        self.signal: signal.Signals | None = None
        self.refused: set[signal.Signals] = set()
        self._before: dict[signal.Signals, Any] = {}
        self._others: dict[signal.Signals, Any] = {}  # what others believe to have set
        self._set: Callable[..., Any] = signal.signal
        self._woken = -1  # descriptor
        self._woken_before = -1
        self._entered = 0
        self._clock = MonotonicClock()
        self._held_until_ns = 0

    @property
    def exit_code(self) -> int:
        """0 without a request, after Ctrl-C and after STOP; 128 + n for signal n."""
        return 0 if self.signal in (None, signal.SIGINT) else 128 + self.signal

    @property
    def asked_by(self) -> str:
        """The signal that asked first, or STOP; empty if nothing did."""
        if self.signal is not None:
            return self.signal.name
        return _STOP if self.requested else ""

    def ask(self, number: int) -> None:
        """Ask for the end in the name of a signal that went another way, or of STOP, which is none."""
        self.requested = True
        if self.signal is None and number in SIGNALS:
            self.signal = signal.Signals(number)

    def __enter__(self) -> Self:
        """Install the handlers; entering again puts them in again."""
        self._entered += 1
        if threading.current_thread() is not threading.main_thread():
            return self
        if self._entered > 1:
            self.reinstall()
            return self
        self._set = signal.signal
        for number in SIGNALS:
            self._before[number] = self._set(number, self._ask)
        signal.signal = self._leave_alone  # type: ignore[assignment]
        _handlers.add(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the earlier handlers when the outermost context ends."""
        self._entered -= 1
        if not self._entered:
            self._give_back()

    def wake(self, descriptor: int) -> None:
        """Make Python write the number of each signal to `descriptor` at once."""
        if self._before and descriptor >= 0:
            self._woken = descriptor
            self._woken_before = signal.set_wakeup_fd(descriptor, warn_on_full_buffer=False)

    def wake_no_more(self) -> None:
        """Stop writing signal numbers to the descriptor."""
        if self._woken != -1:
            self._woken = -1
            signal.set_wakeup_fd(self._woken_before)

    def reinstall(self) -> None:
        """Restore the handlers where others are set, and unblock the signals."""
        if not self._before:
            return
        for number in SIGNALS:
            if signal.getsignal(number) != self._ask:
                self._set(number, self._ask)
                self.refused.add(number)
        if not signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS).isdisjoint(SIGNALS):
            self.refused.update(SIGNALS)
        if self._woken != -1:
            signal.set_wakeup_fd(self._woken, warn_on_full_buffer=False)

    def hold(self, within: float) -> None:
        """Let a second SIGINT interrupt nothing for so many seconds, which an end takes."""
        self._held_until_ns = self._clock.now_ns() + int(within * 1e9)

    @contextmanager
    def held_behind(self, within: float) -> Iterator[None]:
        """Hold a second SIGINT for so many seconds after what is done here, which it does interrupt."""
        try:
            yield
        finally:
            self.hold(within)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Let a second SIGINT interrupt nothing, so that files that are being written become complete."""
        self._held_until_ns = _FOR_EVER_NS
        try:
            yield
        finally:
            self._held_until_ns = 0

    def _ask(self, number: int, _: FrameType | None = None) -> None:
        again = number == signal.SIGINT and self.signal is not None
        forced = number == signal.SIGTERM and self.signal is signal.SIGINT
        if (again or forced) and self._clock.now_ns() >= self._held_until_ns:
            raise Interrupted
        if self._woken != -1:
            with suppress(OSError):
                os.write(self._woken, bytes([number | TAKEN_FLAG]))
        self.ask(number)

    def _leave_alone(self, number: int, handler: Any) -> Any:
        """Replace `signal.signal`: set handlers of other signals, and only note those of these."""
        if number not in SIGNALS:
            return self._set(number, handler)
        known = signal.Signals(number)
        before = self._others.get(known, self._before.get(known))
        self._others[known] = handler
        self.refused.add(known)
        return before

    def _give_back(self) -> None:
        self.wake_no_more()
        if not self._before:
            return
        signal.signal = self._set
        for number, handler in self._before.items():
            self._set(number, handler)
        self._before.clear()
        _handlers.discard(self)

    def _forget_in_fork(self) -> None:
        """Restore the earlier handlers in a forked process, whose end is not that of this run."""
        self._woken_before = -1
        self._give_back()


_handlers: weakref.WeakSet[StopRequest] = weakref.WeakSet()


def _after_fork() -> None:
    for stop in tuple(_handlers):
        stop._forget_in_fork()  # noqa: SLF001 - of this module


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
