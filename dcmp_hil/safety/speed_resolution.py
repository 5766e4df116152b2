"""Resolution of the speed: one count of the encoder over the time of the measurement."""

from __future__ import annotations

import math

SPEED_WINDOW_S = 8e-3  # s, as the device's; docs/protocol.md, section 8
_WINDOW_COUNTS_MIN = 2.0  # counts in it, below which a limit says nothing


def resolution(count: float, period: float) -> float:
    """Return the speed of one count in the window, rad/s.

    Parameters
    ----------
    count
        rad, one count of the encoder; 0 for an ideal one.
    period
        s; the window is rounded up to whole periods.
    """
    return count / (math.ceil(SPEED_WINDOW_S / period - 1e-9) * period)


def lowest_limit(count: float, period: float) -> float:
    """Return the lowest speed limit that can be kept, rad/s; docs/safety.md has the reason."""
    return _WINDOW_COUNTS_MIN * resolution(count, period)
