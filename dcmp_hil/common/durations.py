"""Durations as text, such as `10s`, `200ms` or `2min`: one reader for options and the times of faults."""

from __future__ import annotations

import math
import re

_MICRO = "\N{MICRO SIGN}\N{GREEK SMALL LETTER MU}"  # keyboards have the one or the other; they look the same
_SECONDS_PER_UNIT = {"": 1.0, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
_SECONDS_PER_UNIT |= {f"{micro}s": _SECONDS_PER_UNIT["us"] for micro in _MICRO}
_DURATION = re.compile(rf"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-z{_MICRO}]*)", re.ASCII)

EXAMPLES = "a time such as 3s, 200ms or 2min"
"""What is expected, in words."""


def seconds(text: str) -> float:
    """Return a duration in s; a number without a unit is in s.

    Parameters
    ----------
    text
        A number, and us, ms, s, min or h behind it.

    Raises
    ------
    ValueError
        If it is no finite duration: with what was written, and what is expected.
    """
    found = _DURATION.fullmatch(text.strip())
    if found is not None and found[2] in _SECONDS_PER_UNIT:
        value = float(found[1]) * _SECONDS_PER_UNIT[found[2]]
        if math.isfinite(value):
            return value
    raise ValueError(f'got "{text}"; expected {EXAMPLES}; a plain number is in s.')
