"""A ring of fixed rows between the loop, which never waits, and its readers in any process."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.values import Reference

if TYPE_CHECKING:
    import mmap

    from numpy.typing import NDArray

    from dcmp_hil.values import Cycle, Truth

FIELDS = (
    *("t", "position", "voltage_applied", "fault"),
    *("position_estimate", "velocity_estimate", "disturbance_estimate"),
    *("position_ahead", "velocity_ahead", "acceleration_ahead"),  # the reference at t + delay
    *("voltage_demand", "voltage_sent"),
    *("period", "lateness", "compute"),
    *("position_true", "velocity_true", "disturbance_true"),
    *("position_reference", "velocity_reference", "acceleration_reference"),  # at t
    "began",  # device time at which the trajectory began; infinity before it did
)
"""Columns that every row has, in SI units, in the order in which a Cycle and what goes with it are laid out
flat. A run may have further ones behind them, each named with its unit."""

NO_REFERENCE = Reference(math.nan, math.nan, math.nan)
_HEADER_BYTES = 64


def size_of(capacity: int, further: int = 0) -> int:
    """Return the bytes that a ring of so many rows takes, each with so many further fields."""
    return _HEADER_BYTES + capacity * _row(further).size


def capacity_of(size: int, further: int = 0) -> int:
    """Return how many rows a ring of so many bytes holds, each with so many further fields."""
    return (size - _HEADER_BYTES) // _row(further).size


def _row(further: int) -> struct.Struct:
    """Return the layout of a row: its number comes first, since that is the first to change."""
    return struct.Struct(f"{1 + len(FIELDS) + further}d")


class Ring:
    """One producer, any number of consumers; the oldest rows are overwritten, read or not.

    Every Ring over the same memory has a reading position of its own; one of them alone may push.

    Parameters
    ----------
    capacity
        Rows kept; the producer may be this far ahead before rows are lost.
    memory
        Of `size_of(capacity, len(further))` bytes, zeros at first; None allocates memory that is not shared.
    further
        Names of the fields of a row behind `FIELDS`.
    """

    def __init__(
        self,
        capacity: int,
        memory: mmap.mmap | bytearray | None = None,
        further: tuple[str, ...] = (),
    ) -> None:
        self.capacity, self.further = capacity, further
        self.memory = bytearray(size_of(capacity, len(further))) if memory is None else memory
        layout = _row(len(further))
        self._row_bytes, self._pack = layout.size, layout.pack_into
        self.dropped = 0  # rows overwritten before they were read here
        self.position = 0  # the next row to read
        self._rows = np.frombuffer(self.memory, np.float64, offset=_HEADER_BYTES).reshape(capacity, -1)
        self._written = 0
        # One store of the CPU; `pack_into` would clear the place first, and a reader might find 0 there.
        self._count = memoryview(self.memory)[:8].cast("q")

    def push(
        self,
        cycle: Cycle,
        truth: Truth,
        now: Reference = NO_REFERENCE,
        began: float = -math.inf,
        further: tuple[float, ...] = (),
    ) -> None:
        """Write one row, `now` being the reference at the sample's instant; constant time, never blocks."""
        sample, estimate, reference, demand, voltage, timing = cycle
        k = self._written
        row = _HEADER_BYTES + k % self.capacity * self._row_bytes
        self._pack(
            self.memory, row, k, *sample, *estimate, *reference, demand, voltage, *timing, *truth,
            *now, began, *further,
        )  # fmt: skip
        self._written = k + 1
        self._count[0] = k + 1

    @property
    def written(self) -> int:
        """Number of rows written so far."""
        return self._count[0]

    @property
    def newest(self) -> float:
        """Device time of the newest row, s; 0 before the first."""
        written = self.written
        return float(self._rows[(written - 1) % self.capacity, 1]) if written else 0.0

    def latest(self) -> dict[str, float]:
        """Return the newest row by `FIELDS` and further names; an empty mapping before the first row."""
        written = self.written
        row = self._rows[(written - 1) % self.capacity].tolist()
        names = (*FIELDS, *self.further)
        return dict(zip(names, row[1:], strict=True)) if written and row[0] == written - 1 else {}

    def reader(self) -> Ring:
        """Return a ring over the same memory, which reads from the first row on."""
        return Ring(self.capacity, self.memory, self.further)

    def __len__(self) -> int:
        """Return the number of rows not read yet, including those already overwritten."""
        return self.written - self.position

    def drain(self) -> NDArray[np.float64]:
        """Return every row that this reader has not read yet, oldest first.

        Returns
        -------
        ndarray, shape (n, len(FIELDS) + len(further))
            A copy. Rows that the producer overwrote, even during the copy, are left out and counted.
        """
        written = self.written
        first = max(self.position, written - self.capacity)
        numbers = np.arange(first, written)
        slots = numbers % self.capacity
        rows = self._rows[slots, 1:]
        whole = self._rows[slots, 0] == numbers  # after the copy: a row is numbered before it is overwritten
        self.dropped += written - self.position - int(np.count_nonzero(whole))
        self.position = written
        return rows if whole.all() else rows[whole]
