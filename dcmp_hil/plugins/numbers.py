"""Numbers out of the values that a class of the user's own returns."""

from __future__ import annotations

import operator
from numbers import Real


def plain_number(value: object) -> float | None:
    """Return a number as a float, NaN and infinity too; None for what is no number, or too large for one."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        return float(value)
    except (OverflowError, TypeError, ValueError):
        return None


def whole_number(value: object) -> int | None:
    """Return a whole number as an int; None for a value that is none."""
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return None
