"""Cost of each observer: one step on the samples of a nominal ride, the observers taken in turn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from dcmp_hil.comparison.cost import cost_per_step
from tools.nominal_ride import fresh, kinds, ride, samples

BASE, JUDGED = "super_twisting", "friction_kalman"
RATIO_MAX = 2.6
_REPETITION_COUNT, _RIDE_S = 5, 20.0


@dataclass(frozen=True, slots=True)
class ObserverCosts:
    """Cost of one step, us, by the kind of the observer: a figure for each repetition."""

    us: dict[str, list[float]]

    @property
    def ratios(self) -> list[float]:
        """Cost of the judged observer over that of the base, of each repetition."""
        return [one / other for one, other in zip(self.us[JUDGED], self.us[BASE], strict=True)]


def observer_costs(repetitions: int = _REPETITION_COUNT, seconds: float = _RIDE_S) -> ObserverCosts:
    """Measure every kind on the samples of one ride, closed by the judged observer.

    In each repetition the observers take turns, and of every hundred samples the best of 15 rounds counts.

    Raises
    ------
    RuntimeError
        If an observer fails on the samples.
    """
    met = samples(ride(JUDGED, seconds))
    makers = {kind: partial(fresh, kind) for kind in kinds()}
    us: dict[str, list[float]] = {kind: [] for kind in makers}
    for _ in range(repetitions):
        for kind, cost in cost_per_step(makers, met).items():
            if cost is None:
                raise RuntimeError(f"{kind} failed on the samples of the ride")
            us[kind].append(cost)
    return ObserverCosts(us)
