"""Faults of the encoder."""

from __future__ import annotations

import math

from sim_backend.faults.plant_fault import PlantFault


class Stuck(PlantFault):
    """The encoder shows the last count for ever."""

    _shown: float | None = None

    def begin(self) -> None:
        """Forget an earlier time."""
        self._shown = None

    def count(self, counts: float) -> float:
        """Return the first count again."""
        if self._shown is None:
            self._shown = counts
        return self._shown


class Jump(PlantFault):
    """The encoder gains counts, `times` times, `every` periods apart, and they stay."""

    _age = -1

    def count(self, counts: float) -> float:
        """Return the count with the jumps so far."""
        self._age += 1
        jumps = min(self._age // round(self.number("every")) + 1, round(self.number("times")))
        return counts + jumps * round(self.number("counts"))


class Glitch(PlantFault):
    """The encoder shows a wrong count in one period of `every`."""

    _age = -1

    def count(self, counts: float) -> float:
        """Return the count, wrong in every `every`-th period."""
        self._age += 1
        ordinal, rest = divmod(self._age, round(self.number("every")))
        wrong = rest == 0 and ordinal < self.number("times")
        return counts + round(self.number("counts")) if wrong else counts


class EncoderNoise(PlantFault):
    """The encoder has Gaussian noise, in whole counts."""

    def count(self, counts: float) -> float:
        """Return the count with noise."""
        return counts + round(self.rng.gauss(0.0, self.number("counts")))


class Missed(PlantFault):
    """The encoder loses counts for ever, each with probability `p`."""

    _last: float | None = None
    _lost = 0

    def count(self, counts: float) -> float:
        """Return the count minus the lost counts."""
        moved = 0 if self._last is None else round(counts - self._last)
        self._last = counts
        lost = sum(self.rng.random() < self.number("p") for _ in range(min(abs(moved), 1000)))
        self._lost += lost if moved > 0 else -lost
        return counts - self._lost


class EncoderSign(PlantFault):
    """The encoder counts the other way from where it is."""

    _from: float | None = None

    def count(self, counts: float) -> float:
        """Return the count mirrored at where it was first."""
        if self._from is None:
            self._from = counts
        return 2.0 * self._from - counts


class Scale(PlantFault):
    """The encoder has `factor` times the counts a revolution that the rig says."""

    def count(self, counts: float) -> float:
        """Return the count of an encoder with `factor` times the resolution."""
        return math.floor(counts * self.number("factor") + 0.5)
