"""Cost of each observer: one step on the samples of a nominal ride, the observers taken in turn."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dcmp_hil import load_rig, run
from dcmp_hil.assembly import make_observer
from dcmp_hil.config.rig import KINDS
from dcmp_hil.values import Sample

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

BASE, JUDGED = "super_twisting", "friction_kalman"
RATIO_MAX = 2.6
_ROUND_COUNT, _RIDE_S = 9, 20.0
# The trajectory at once, from the paper's pose, with the zero of the encoder between two edges.
_RIDE = ("supervisor.start=immediate", "sim.position_rad=-1.57", "sim.encoder_phase_counts=0.43")


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


def kinds() -> list[str]:
    """Return every kind of observer that comes with the package."""
    return [kind for kind in KINDS["observer"] if kind != "custom"]


def observer_costs(rounds: int = _ROUND_COUNT, seconds: float = _RIDE_S) -> ObserverCosts:
    """Measure every kind on the samples of one ride, closed by the judged observer."""
    samples = _samples(load_rig("bench-1khz", [*_RIDE, f"observer.kind={JUDGED}"]), seconds)
    rigs = {kind: load_rig("bench-1khz", [*_RIDE, f"observer.kind={kind}"]) for kind in kinds()}
    us: dict[str, list[float]] = {kind: [] for kind in rigs}
    for _ in range(rounds):
        for kind, rig in rigs.items():
            us[kind].append(_step_us(rig, samples))
    return ObserverCosts(us)


def _samples(rig: Rig, seconds: float) -> list[Sample]:
    columns = run(rig, duration=seconds, fast=True).columns
    names = ("time_s", "position_rad", "voltage_applied_V")
    return [Sample(*row) for row in zip(*(columns[name].tolist() for name in names), strict=True)]


def _step_us(rig: Rig, samples: list[Sample]) -> float:
    update = make_observer(rig).update
    began = time.process_time()
    for sample in samples:
        update(sample)
    return 1e6 * (time.process_time() - began) / len(samples)
