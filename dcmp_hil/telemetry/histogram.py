"""How long the periods of a run really were, as a histogram that grows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BINS = 61  # odd, so that the nominal period lies in the middle of a bar
_REACH = 0.5  # of a period, either way
_EVERY = 1.0  # s between two pictures of it


class PeriodHistogram:
    """Counts of periods from half to one and a half of the nominal; what lies outside is in the last bars.

    Parameters
    ----------
    period
        s, nominal.
    """

    def __init__(self, period: float) -> None:
        self._edges = 1e6 * period * np.linspace(1.0 - _REACH, 1.0 + _REACH, _BINS + 1)
        self.centres_us = 0.5 * (self._edges[1:] + self._edges[:-1])
        self.widths_us = np.diff(self._edges)
        self.counts = np.zeros(_BINS, np.int64)
        self._due = -np.inf

    def add(self, t: NDArray[np.float64], period: NDArray[np.float64]) -> bool:
        """Count `period` (s, NaN left out); tell whether it is time, by the `t` of the rows, to show it."""
        known = period[~np.isnan(period)] * 1e6
        self.counts += np.histogram(np.clip(known, self._edges[0], self._edges[-1]), self._edges)[0]
        if t[-1] < self._due:
            return False
        self._due = float(t[-1]) + _EVERY
        return True
