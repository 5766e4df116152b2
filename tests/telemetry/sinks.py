"""Sinks that note, refuse, sleep or strike, and what tests do with the processes that make them."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.values import UNKNOWN_TRUTH, Event, Reference
from tests.helpers import cycle

if TYPE_CHECKING:
    import signal
    from collections.abc import Callable

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.telemetry_process import TelemetryProcess

T = 1e-3  # s
TIMEOUT_S = 60.0  # s: generous, these machines are shared
HELD = Reference(0.0, 0.0, 0.0)


class Notes:
    """A sink that writes what it sees into a file, from any process."""

    def __init__(self, file: Path, warnings: tuple[str, ...] = ()) -> None:
        self._file = file
        self.warnings = list(warnings)
        self._write(f"pid {os.getpid()}")

    def block(self, block: Block) -> None:
        """Note how many rows there are."""
        self._write(f"rows {len(block)}")

    def event(self, event: Event) -> None:
        """Note its text."""
        self._write(f"event {event.text}")

    def close(self) -> None:
        """Write a note about the close."""
        self._write("closed")

    def _write(self, line: str) -> None:
        with self._file.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


class Refuses(Notes):
    """A sink that cannot be made."""

    def __init__(self, error: Exception) -> None:
        raise error


class Sleeps(Notes):
    """A sink that takes its time to be made."""

    def __init__(self, seconds: float) -> None:
        time.sleep(seconds)


class Strikes:
    """A sink in this process that does something at its first block after `at`, once."""

    def __init__(self, at: float, act: Callable[[], None]) -> None:
        self._at, self._act = at, act
        self.struck = False

    def block(self, block: Block) -> None:
        """Raise an exception."""
        if not self.struck and block["t"][-1] >= self._at:
            self.struck = True
            self._act()

    def event(self, event: Event) -> None:
        """Ignore it."""

    def close(self) -> None:
        """Do nothing."""


def children() -> list[int]:
    """Return the processes that this one started and that are there."""
    return [
        int(word) for file in Path("/proc/self/task").glob("*/children") for word in file.read_text().split()
    ]


def strike_all(number: signal.Signals) -> None:
    """Send a signal to every process that this one started."""
    for pid in children():
        os.kill(pid, number)


def noted(file: Path, what: str) -> list[str]:
    """Return the lines of that kind, without the kind."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return [line.removeprefix(what).strip() for line in lines if line.startswith(what)]


def fill(apart: TelemetryProcess, periods: int, first: int = 0) -> None:
    """Record cycles as the loop does."""
    for k in range(first, first + periods):
        apart.ring.push(cycle(k * T), UNKNOWN_TRUTH, HELD)
