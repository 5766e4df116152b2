"""Cost of a run of the loop with the plant on the compiled core against the same with the Python plant."""

from __future__ import annotations

import statistics
import time
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil import load_rig, simulate

if TYPE_CHECKING:
    from collections.abc import Sequence

_ROUND_COUNT = 7
_DURATIONS_S = {200.0: 20.0, 20.0: 10.0}
_BARS = {200.0: 1.08, 20.0: 1.4}
_GOAL = 1.4


class CoreRatios(NamedTuple):
    """Ratios at one plant step: CPU time with the Python plant over CPU time on the core."""

    step_us: float
    ratios: Sequence[float]

    @property
    def goal(self) -> str:
        """Bar and goal, with what was found of both."""
        found, bar = statistics.median(self.ratios), _BARS[self.step_us]
        said = [f">= {bar:g}: {_verdict(found, bar)}"]
        if bar < _GOAL:
            said.append(f"goal {_GOAL:g}: {_verdict(found, _GOAL)}")
        return "; ".join(said)


def _verdict(found: float, least: float) -> str:
    return "met" if found >= least else "not met"


def core_ratios(step_us: float) -> CoreRatios:
    """Take both in turn, in virtual time; the library is compiled before."""
    duration = _DURATIONS_S[step_us]
    _cost(step_us, "core", 0.1)
    pairs = [[_cost(step_us, engine, duration) for engine in ("core", "python")] for _ in range(_ROUND_COUNT)]
    return CoreRatios(step_us, [python / core for core, python in pairs])


def _cost(step_us: float, engine: str, duration: float) -> float:
    rig = load_rig("bench-1khz", [f"sim.step_us={step_us}", f"sim.engine={engine}"])
    began = time.process_time()
    simulate(rig, duration, plain=True)
    return time.process_time() - began
