"""Envelopes of a run for pages that draw it: the extremes of every drawn column in short stretches of time.

Every cycle counts: a value of one cycle is the extreme of its bucket.
"""

from __future__ import annotations

import math
from collections import deque
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.telemetry.block import Block

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig

BUCKET_S = 0.04  # s
"""Length of a bucket: at 1,000 pixels for the history, two pixels."""
HISTORY_S = 20.0  # s
"""Time of a run that is kept."""
BUCKETS_PER_LINE_MAX = 100
"""Buckets that one line carries: about 20 kB."""
COLUMNS = (
    *("position_rad", "reference_rad", "velocity_rad_s", "error_mrad", "voltage_V"),
    *("disturbance_rad_s2", "gravity_rad_s2", "friction_rad_s2", "rest_rad_s2", "lateness_us"),
)
"""Drawn columns, in the order of a bucket's pairs of least and greatest value."""
_BUCKETS_MAX = round(HISTORY_S / BUCKET_S)
_LATE_MIN_PERIODS = 0.5  # of a period: a sample that arrives later than this counts as late

Bucket = list[float | None]
"""Middle of the cycles' device times, s; late cycles; then least and greatest value of each column, None
where there was no number."""


class BucketHistory:
    """Newest buckets of a run, numbered from its first one on; older ones are dropped."""

    def __init__(self) -> None:
        self._buckets: deque[Bucket] = deque(maxlen=_BUCKETS_MAX)
        self._count = 0  # of all there ever were

    def add(self, buckets: Iterable[Bucket]) -> None:
        """Add the next ones."""
        for bucket in buckets:
            self._buckets.append(bucket)
            self._count += 1

    def clear(self) -> None:
        """Drop all; the numbers go on."""
        self._buckets.clear()

    def after(self, place: int, most: int = BUCKETS_PER_LINE_MAX) -> tuple[int, list[Bucket]]:
        """Return at most so many buckets from number `place` on, and the number of the next one."""
        first = self._count - len(self._buckets)
        place = max(place, first)
        found = list(islice(self._buckets, place - first, place - first + most))
        return place + len(found), found

    def newest(self, place: int) -> list[Bucket]:
        """Return the buckets from number `place` on, of many the newest that one line carries."""
        return self.after(max(place, self._count - BUCKETS_PER_LINE_MAX))[1]


class Envelopes:
    """Reduces rows of the ring to buckets, as they come.

    Parameters
    ----------
    rig
        As it runs: its model splits the disturbance, its period says which cycles are late.

    Attributes
    ----------
    history
        The complete buckets.
    late
        Cycles so far whose sample arrived more than half a period late.
    """

    def __init__(self, rig: Rig) -> None:
        self._model, self._late_s = rig.model.values(), _LATE_MIN_PERIODS * rig.period
        self._open: _Open | None = None
        self.history = BucketHistory()
        self.late = 0

    def add(self, rows: NDArray[np.float64]) -> None:
        """Add cycles, oldest first, shape (n, len(FIELDS) or more) as `Ring.drain` gives them."""
        rows = rows[np.isfinite(rows[:, 0])]
        if not len(rows):
            return
        block = Block(rows, self._model)
        t, late = block["t"], block["lateness"] > self._late_s
        self.late += int(late.sum())
        numbers = np.floor(t / BUCKET_S)
        starts = np.flatnonzero(np.diff(numbers, prepend=np.nan) != 0.0)
        ends = np.append(starts[1:], len(t)) - 1
        with np.errstate(all="ignore"):  # numbers without bound are drawn as none
            values = _drawn(block)
        low, high = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
        counts = np.add.reduceat(late.astype(np.int64), starts)
        for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
            self._put(
                _Open(
                    *(float(numbers[start]), float(t[start]), float(t[end])),
                    *(int(counts[k]), low[k], high[k]),
                )
            )

    def finish(self) -> None:
        """Count the last bucket as complete: no cycle follows."""
        if self._open is not None:
            self.history.add([self._open.bucket()])
            self._open = None

    def _put(self, part: _Open) -> None:
        if self._open is not None and self._open.number == part.number:
            self._open.join(part)
            return
        self.finish()
        self._open = part


class _Open:
    """A bucket that may still grow."""

    def __init__(
        self,
        number: float,
        first: float,
        last: float,
        late: int,
        low: NDArray[np.float64],
        high: NDArray[np.float64],
    ) -> None:
        self.number, self.late = number, late
        self._first, self._last = first, last
        self._low, self._high = low, high

    def join(self, later: _Open) -> None:
        """Take in the later part of the same bucket."""
        self._last = later._last
        self.late += later.late
        self._low, self._high = np.fmin(self._low, later._low), np.fmax(self._high, later._high)

    def bucket(self) -> Bucket:
        pairs = np.column_stack([self._low, self._high]).ravel().tolist()
        return [round(0.5 * self._first + 0.5 * self._last, 5), self.late, *_rounded(pairs)]


def _drawn(block: Block) -> NDArray[np.float64]:
    """Return the drawn columns, shape (n, len(COLUMNS)); NaN where there is nothing to draw."""
    position, w = block["position"], block["disturbance_estimate"]
    reference = np.where(block["t"] < block["began"], np.nan, block["position_reference"])
    columns = np.column_stack(
        [
            *(position, reference, block["velocity_estimate"], 1e3 * (position - reference)),
            *(block["voltage_applied"], w, block.gravity, block.friction, w - block.gravity - block.friction),
            1e6 * block["lateness"],
        ]
    )
    columns[~np.isfinite(columns)] = np.nan
    return columns


def _rounded(values: Sequence[float]) -> list[float | None]:
    """Round to six digits, more than a screen shows."""
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in values]
