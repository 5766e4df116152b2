"""How a run ends from outside: Ctrl-C and signals become a request that the loop sees once a period."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType, TracebackType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest:
    """Turns SIGINT, SIGTERM and SIGHUP into `requested` while it is entered.

    A second SIGINT raises KeyboardInterrupt at once: the way out of a stage that hangs. Outside the main
    thread, where Python allows no handlers, only `requested` itself works.
    """

    def __init__(self) -> None:
        self.requested = False
        self.signal: signal.Signals | None = None  # what asked, if a signal did
        self._before: dict[signal.Signals, object] = {}
        self._entered = 0
        self._held = False

    @property
    def exit_code(self) -> int:
        """0 if nobody asked, or Ctrl-C did; 128 + n for signal n."""
        return 0 if self.signal in (None, signal.SIGINT) else 128 + self.signal

    def __enter__(self) -> Self:
        """Install the handlers; entering again changes nothing."""
        self._entered += 1
        if self._entered == 1 and threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the handlers of before back, when the outermost leaves."""
        self._entered -= 1
        if self._entered:
            return
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        self._before.clear()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Let a second SIGINT interrupt nothing for a moment: what is written meanwhile is written wholly."""
        before, self._held = self._held, True
        try:
            yield
        finally:
            self._held = before

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.requested and number == signal.SIGINT and not self._held:
            signal.default_int_handler(number, frame)
        self.requested = True
        self.signal = self.signal or signal.Signals(number)
