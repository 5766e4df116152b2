"""Observers that are wrong without a NaN: a speed limit that believes them is none."""

from __future__ import annotations

import random
from collections import deque
from typing import TYPE_CHECKING

from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.values import Sample


class Right:
    """The rig's own observer, which the other classes change."""

    def __init__(self, context: ObserverContext) -> None:
        self._observer = SuperTwisting(context)

    def update(self, sample: Sample) -> Estimate:
        """Return the estimate of the rig's own observer."""
        return self._observer.update(sample)


class Zero(Right):
    """Returns an estimate of zeros."""

    def update(self, sample: Sample) -> Estimate:
        """Return zeros."""
        super().update(sample)
        return Estimate(0.0, 0.0, 0.0)


class WrongSign(Right):
    """Returns the estimate with the wrong sign."""

    def update(self, sample: Sample) -> Estimate:
        """Return everything negated."""
        return Estimate(*(-value for value in super().update(sample)))


class Frozen(Right):
    """Returns its first estimate for ever."""

    _said: Estimate | None = None

    def update(self, sample: Sample) -> Estimate:
        """Return the first estimate for ever."""
        self._said = self._said or super().update(sample)
        return self._said


class Scaled(Right):
    """A tenth of everything, as of a gear or a unit that was forgotten."""

    def update(self, sample: Sample) -> Estimate:
        """Return a tenth."""
        return Estimate(*(0.1 * value for value in super().update(sample)))


class Garbage(Right):
    """Numbers, none of which means anything, the velocity within what is allowed."""

    def __init__(self, context: ObserverContext, seed: int = 1) -> None:
        super().__init__(context)
        self._random = random.Random(seed)

    def update(self, sample: Sample) -> Estimate:
        """Return random numbers."""
        super().update(sample)
        draw = self._random.uniform
        return Estimate(draw(-4.0, 4.0), draw(-0.4, 0.4), draw(-50.0, 50.0))


class Delayed(Right):
    """Returns the estimate of 100 samples ago."""

    def __init__(self, context: ObserverContext) -> None:
        super().__init__(context)
        self._said: deque[Estimate] = deque(maxlen=100)

    def update(self, sample: Sample) -> Estimate:
        """Return an old estimate."""
        self._said.append(super().update(sample))
        return self._said[0]


KINDS = {
    "answers 0": "Zero",
    "wrong sign": "WrongSign",
    "frozen": "Frozen",
    "scaled by 0.1": "Scaled",
    "garbage": "Garbage",
    "delayed by 0.1 s": "Delayed",
}
"""The six kinds: what is wrong, and the class."""
