"""Cost of each observer: one step on the samples of a nominal ride, the observers taken in turn."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tools.nominal_ride import fresh, kinds, ride, samples

if TYPE_CHECKING:
    from dcmp_hil.control.observers import Observer
    from dcmp_hil.values import Sample

BASE, JUDGED = "super_twisting", "friction_kalman"
RATIO_MAX = 2.6
_ROUND_COUNT, _RIDE_S = 9, 20.0


@dataclass(frozen=True, slots=True)
class ObserverCosts:
    """Cost of one step, us, by the kind of the observer: a figure a round."""

    us: dict[str, list[float]]

    @property
    def ratio(self) -> tuple[float, float, float]:
        """Cost of the judged observer over that of the base: of the best rounds, then least and most."""
        judged, base = self.us[JUDGED], self.us[BASE]
        rounds = [one / other for one, other in zip(judged, base, strict=True)]
        return min(judged) / min(base), min(rounds), max(rounds)


def observer_costs(rounds: int = _ROUND_COUNT, seconds: float = _RIDE_S) -> ObserverCosts:
    """Measure every kind on the samples of one ride, closed by the judged observer."""
    met = samples(ride(JUDGED, seconds))
    us: dict[str, list[float]] = {kind: [] for kind in kinds()}
    for _ in range(rounds):
        for kind, of_kind in us.items():
            of_kind.append(_step_us(fresh(kind), met))
    return ObserverCosts(us)


def _step_us(observer: Observer, met: list[Sample]) -> float:
    update = observer.update
    began = time.process_time()
    for sample in met:
        update(sample)
    return 1e6 * (time.process_time() - began) / len(met)
