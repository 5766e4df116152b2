"""Range of a number: the one check of it, and the words for what is allowed."""

from __future__ import annotations

import math
from typing import NamedTuple

_PLAIN_NUMBER_MAX = 1e15  # beyond it a float no longer holds every whole number


def number(value: float) -> str:
    """Write a number so that it reads back as the same one."""
    short = f"{value:g}"
    if "e" not in short and float(short) == value:
        return short
    whole = abs(value) < _PLAIN_NUMBER_MAX and value == int(value)
    return str(int(value)) if whole else repr(value)


class NumberRange(NamedTuple):
    """Bounds of a number, in the unit of the number; infinite for none."""

    low: float = -math.inf
    high: float = math.inf
    low_excluded: bool = False
    high_excluded: bool = False

    def holds(self, value: float) -> bool:
        """Return whether a number is within the bounds; NaN is in no range."""
        above = self.low < value if self.low_excluded else self.low <= value
        return above and (value < self.high if self.high_excluded else value <= self.high)

    def words(self, unit: str = "", what: str = "a number") -> str:
        """Return what is allowed, such as "a number in rad/s, above 0 and at most 1000"."""
        ends = (
            (self.low, "above" if self.low_excluded else "at least"),
            (self.high, "below" if self.high_excluded else "at most"),
        )
        parts = [f"{word} {number(end)}" for end, word in ends if math.isfinite(end)]
        bounds = f", {' and '.join(parts)}" if parts else ""
        return f"{what}{f' in {unit}' if unit else ''}{bounds}"
