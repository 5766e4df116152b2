"""The device's clock against this computer's, from the instants at which samples arrive."""

from __future__ import annotations

from collections import deque
from statistics import median, quantiles

_WINDOW_TICKS = 256  # ticks
_NOISE_FREE_SLOPE_SPREAD = 2.5e-3  # of a slope: a spread that says nothing against the median
_SPREAD_RATIO_MAX = 1.1
"""Of the median: as much as a clock shows that goes wrong in the middle of what is looked at."""
_SLOPES_MIN = 4  # fewer say nothing
_SLOPES_MAX = 12  # older ones say nothing of the clock as it goes now


class ClockRatio:
    """Rate of the device's clock against this computer's.

    A sample may arrive late and never early, so the earliest arrival of a window of 256 ticks shows the
    shortest delay of the line. How that moves from window to window is the error of the clock; the median
    over the newest twelve leaves out those in which this computer stood still. A clock that goes wrong later,
    in any minute of a run, shows two seconds later at 1 kHz.

    Parameters
    ----------
    period_ns
        ns, nominal, of a tick.
    """

    def __init__(self, period_ns: float) -> None:
        self._period_ns = period_ns
        self._ends = 0
        self._earliest = 0.0  # ns, arrival after the nominal instant: the smallest of this window
        self._tick = 0  # at which it was
        self._before: tuple[int, float] | None = None  # the same of the window before
        self._slopes: deque[float] = deque(maxlen=_SLOPES_MAX)

    def add(self, tick: int, heard_ns: int) -> None:
        """Add a sample's tick, and the instant of its arrival."""
        offset = heard_ns - tick * self._period_ns
        if tick >= self._ends:
            self._close_window(tick)
            self._earliest, self._tick = offset, tick
        elif offset < self._earliest:
            self._earliest, self._tick = offset, tick

    @property
    def error(self) -> float | None:
        """Return the relative error of the device's clock: -0.02 is 2 % slow; None if not known."""
        if len(self._slopes) < _SLOPES_MIN:
            return None
        longer = median(self._slopes)  # a nominal period takes so much longer than it should
        first, _, third = quantiles(self._slopes, n=4)
        if third - first > max(_SPREAD_RATIO_MAX * abs(longer), _NOISE_FREE_SLOPE_SPREAD):
            return None  # this computer stood still too often to tell
        return 1.0 / (1.0 + longer) - 1.0

    def _close_window(self, tick: int) -> None:
        if self._ends:
            if self._before is not None:
                apart = self._tick - self._before[0]
                if apart > 0:
                    self._slopes.append((self._earliest - self._before[1]) / (apart * self._period_ns))
            self._before = self._tick, self._earliest
        self._ends = tick + _WINDOW_TICKS
