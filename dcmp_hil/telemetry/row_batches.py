"""Rows of cycles that come many at a time, in place of the ring's one by one."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.values import Cycle, Estimate, Fault, Reference, Sample, Timing

if TYPE_CHECKING:
    from numpy.typing import NDArray

_PLACE = {name: place for place, name in enumerate(FIELDS)}
_ESTIMATE, _AHEAD = _PLACE["position_estimate"], _PLACE["position_ahead"]
_DEMAND, _SENT, _PERIOD = _PLACE["voltage_demand"], _PLACE["voltage_sent"], _PLACE["period"]


class RowBatches:
    """Takes rows as arrays, and hands them on as blocks.

    Parameters
    ----------
    recent
        Cycles kept for the black box.
    further
        Names of the columns behind `FIELDS`.

    Attributes
    ----------
    written
        Number of rows taken.
    newest
        Device time of the newest row, s; 0 before the first.
    position
        Number of the next row to drain.
    dropped
        Always 0: nothing is overwritten.
    """

    def __init__(self, recent: int, further: tuple[str, ...] = ()) -> None:
        self.further, self.newest = further, 0.0
        self.written = self.position = self.dropped = 0
        self._recent = recent
        self._waiting: list[NDArray[np.float64]] = []
        self._kept: deque[NDArray[np.float64]] = deque()
        self._kept_rows = 0

    def add(self, rows: NDArray[np.float64]) -> None:
        """Take rows, shape (n, fields), n > 0; they are not copied, and must stay as they are."""
        self._waiting.append(rows)
        self._kept.append(rows)
        self.written += len(rows)
        self.newest = float(rows[-1, 0])
        self._kept_rows += len(rows)
        while self._kept_rows - len(self._kept[0]) >= self._recent:
            self._kept_rows -= len(self._kept.popleft())

    def __len__(self) -> int:
        """Return the number of rows not drained yet."""
        return self.written - self.position

    def drain(self) -> NDArray[np.float64]:
        """Return every row not drained yet, oldest first, shape (n, fields)."""
        waiting, self._waiting, self.position = self._waiting, [], self.written
        if len(waiting) == 1:
            return waiting[0]
        return np.concatenate(waiting) if waiting else np.empty((0, len(FIELDS) + len(self.further)))

    def recent(self) -> tuple[list[Cycle], list[tuple[float, ...]]]:
        """Return the last cycles, and their further columns."""
        rows = [row for batch in self._kept for row in batch.tolist()][-self._recent :]
        return [cycle_of(row) for row in rows], [tuple(row[len(FIELDS) :]) for row in rows]


def cycle_of(row: list[float]) -> Cycle:
    """Return a row as the cycle that the loop would have recorded."""
    t, position, voltage, fault = row[:_ESTIMATE]
    return Cycle(
        Sample(t, position, voltage, Fault(int(fault))),
        Estimate(*row[_ESTIMATE:_AHEAD]),
        Reference(*row[_AHEAD:_DEMAND]),
        row[_DEMAND],
        row[_SENT],
        Timing(*row[_PERIOD : _PERIOD + 3]),
    )
