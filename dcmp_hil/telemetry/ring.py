"""A ring of fixed rows between the loop, which never waits, and whoever drains it."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.values import Cycle, Truth

FIELDS = (
    *("t", "position", "voltage_applied", "fault"),
    *("position_estimate", "velocity_estimate", "disturbance_estimate"),
    *("position_ahead", "velocity_ahead", "acceleration_ahead"),  # the reference at t + delay
    *("voltage_demand", "voltage_sent"),
    *("period", "lateness", "compute"),
    *("position_true", "velocity_true", "disturbance_true"),
)
"""Columns of a row, in SI units, in the order in which a Cycle and its Truth are laid out flat."""

_ROW = struct.Struct(f"{len(FIELDS)}d")
_pack = _ROW.pack_into


class Ring:
    """Single producer, single consumer; the oldest rows are overwritten when nobody drains.

    Parameters
    ----------
    capacity
        Rows kept; the producer may be this far ahead before rows are lost.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.dropped = 0  # rows overwritten before they were read
        self._bytes = bytearray(capacity * _ROW.size)
        self._rows = np.frombuffer(self._bytes, np.float64).reshape(capacity, len(FIELDS))
        self._written = 0
        self._read = 0

    def push(self, cycle: Cycle, truth: Truth) -> None:
        """Write one row; constant time, never blocks."""
        sample, estimate, reference, demand, voltage, timing = cycle
        row = self._written % self.capacity * _ROW.size
        _pack(self._bytes, row, *sample, *estimate, *reference, demand, voltage, *timing, *truth)
        self._written += 1

    def __len__(self) -> int:
        """Rows waiting, those already lost included."""
        return self._written - self._read

    def drain(self) -> NDArray[np.float64]:
        """Take every row waiting, oldest first.

        Returns
        -------
        ndarray, shape (n, len(FIELDS))
            A copy. Rows that the producer overwrote, even during the copy, are left out and counted.
        """
        written = self._written
        first = max(self._read, written - self.capacity)
        rows = self._rows[np.arange(first, written) % self.capacity]
        overtaken = max(0, self._written - self.capacity - first)  # the producer went on meanwhile
        self.dropped += first - self._read + min(overtaken, len(rows))
        self._read = written
        return rows[overtaken:]
