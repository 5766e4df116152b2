"""Messages of one name are let through at most once in a period of time, which is an argument.

Its user is the limiter of the loop, which would tell of a limit in every period. Other messages need no such
limit: each cause of a link is warned of once in a run, its counters are told in every second, and of
the web server's lines one of each kind is told.
"""

from __future__ import annotations

import math


class RateLimit:
    """Decides which messages are told; the rest is left out, and not kept.

    Parameters
    ----------
    period
        s from a message that is told to the next one of its name.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._told: dict[str, float] = {}  # s, by name

    def passes(self, name: str, t: float) -> bool:
        """Return whether a message of this name is told at time `t`, s; note that it is."""
        if t - self._told.get(name, -math.inf) < self._period:
            return False
        self._told[name] = t
        return True
