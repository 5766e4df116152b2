"""Histograms of the period, lateness and compute time of a run, which grow during the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.telemetry.signals import ERROR_RGB, FAINT_RGB, TIMING_RGB

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BIN_COUNT = 61  # odd, so that a nominal period lies in the middle of a bar
_SEND_PERIOD_S = 1.0  # s between two pictures of it


class Histogram(NamedTuple):
    """A histogram of the dashboard: one row of its table."""

    field: str  # of the block, s
    column: str  # of the table of signals, which it shows
    name: str  # title of its tab
    low: float  # periods
    high: float  # periods
    colour: tuple[int, int, int]

    @property
    def entity(self) -> str:
        """Return the entity on which it is sent."""
        return f"loop/{self.field}_hist"


HISTOGRAMS = (
    Histogram("period", "period_us", "All periods [µs]", 0.5, 1.5, TIMING_RGB),
    Histogram("lateness", "lateness_us", "All lateness [µs]", 0.0, 0.5, ERROR_RGB),
    Histogram("compute", "compute_us", "Sample to command [µs]", 0.0, 0.5, FAINT_RGB),
)


class FixedRangeHistogram:
    """Counts of durations between two bounds; what lies outside is in the first and the last bar.

    Parameters
    ----------
    low, high
        s.
    """

    def __init__(self, low: float, high: float) -> None:
        self._edges = 1e6 * np.linspace(low, high, _BIN_COUNT + 1)
        self.centres_us = 0.5 * (self._edges[1:] + self._edges[:-1])
        self.widths_us = np.diff(self._edges)
        self.counts = np.zeros(_BIN_COUNT, np.int64)
        self._due = -np.inf

    def add(self, t: NDArray[np.float64], durations: NDArray[np.float64]) -> bool:
        """Count `durations` (s, NaN left out); tell whether it is time, by the rows' `t`, to show it."""
        known = durations[~np.isnan(durations)] * 1e6
        self.counts += np.histogram(np.clip(known, self._edges[0], self._edges[-1]), self._edges)[0]
        if t[-1] < self._due:
            return False
        self._due = float(t[-1]) + _SEND_PERIOD_S
        return True
