"""The rows and events of a run, many times faster than real time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil import run
from dcmp_hil.values import ChangeData, Event, EventKind, LinkData

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.ipc.ring import Ring
    from dcmp_hil.telemetry.block import Block


class _Rows:
    """Keeps the rows of a run."""

    def __init__(self) -> None:
        self.rows: list[NDArray[np.float64]] = []

    def block(self, block: Block) -> None:
        """Keep a copy of the rows of the block."""
        self.rows.append(block.rows.copy())

    def event(self, event: Event) -> None:
        """Ignore the event."""

    def close(self) -> None:
        """Nothing to finish."""


def a_minute(rig: Rig) -> NDArray[np.float64]:
    """Return the rows of a minute of a rig in virtual time."""
    sink = _Rows()
    run(rig, duration=60.0, fast=True, sinks=[sink])
    return np.concatenate(sink.rows)


class Source:
    """Writes rows into a ring, many at once, as the loop does one by one.

    Parameters
    ----------
    ring
        Of a run.
    rows
        Of a minute; they come again and again.

    Attributes
    ----------
    written
        Rows so far.
    """

    def __init__(self, ring: Ring, rows: NDArray[np.float64]) -> None:
        self._ring, self._rows = ring, rows
        self.written = 0

    def write(self, count: int) -> float:
        """Write the next rows; return the device time of the last, s."""
        numbers = np.arange(self.written, self.written + count)
        again, place = np.divmod(numbers, len(self._rows))
        rows = self._rows[place]
        rows[:, 0] += 60.0 * again
        slots = numbers % self._ring.capacity
        memory = self._ring._rows  # noqa: SLF001 - as `push` does, only many
        memory[slots, 0] = numbers
        memory[slots, 1:] = rows
        self.written += count
        self._ring._count[0] = self.written  # noqa: SLF001
        return float(rows[-1, 0])


class Leak:
    """A sink that keeps what it must not: the proof that a soak finds it.

    Parameters
    ----------
    mb_a_minute
        What it keeps in a minute of data.
    """

    def __init__(self, mb_a_minute: float) -> None:
        self._bytes_a_second = 1e6 * mb_a_minute / 60.0
        self._kept: list[bytes] = []

    def block(self, block: Block) -> None:
        """Keep as many bytes as the block is long."""
        seconds = float(block["t"][-1] - block["t"][0])
        self._kept.append(b"\1" * round(self._bytes_a_second * seconds))

    def event(self, event: Event) -> None:
        """Ignore the event."""

    def close(self) -> None:
        """Nothing to finish."""


def events(batch: int, t: float) -> list[Event]:
    """Return what a run says: counters once a second, a change every ten."""
    found = []
    if batch % 10 == 0:
        found.append(Event(t, "DEBUG", EventKind.LINK, "lost=0", LinkData({"lost": 0, "late": batch})))
    if batch % 100 == 0:
        value = 4000.0 + batch % 7
        said = f"controller.kp_1_s2: 4000 -> {value:g}"
        found.append(Event(t, "INFO", EventKind.CHANGE, said, ChangeData({"controller.kp_1_s2": value})))
    return found
