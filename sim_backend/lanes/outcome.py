"""From the state of a lane at its end to the outcome of its run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.safety.diagnosis import Diagnosis, window_samples
from dcmp_hil.sweeping.engine import RunOutcome
from dcmp_hil.values import Sample

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from sim_backend.lanes.group_run import GroupResult

_CAUSES = ("", "not_finite", "speed", "travel", "disturbance", "tracking", "saturation", "chatter")
"""Reasons of a TripError by the numbers of lanes.h."""
DISTURBANCE = _CAUSES.index("disturbance")
"""The one whose likely cause is told from the last samples."""
_NUMBERS = (
    *("periods", "tracking_cycles", "tracking_squares", "tracking_max"),
    *("velocity_cycles", "velocity_squares", "velocity_error_max"),
    *("disturbance_cycles", "disturbance_squares", "disturbance_error_max"),
    *("peak", "variation", "t", "cause"),
)


def outcomes_of(result: GroupResult, count: int) -> list[RunOutcome]:
    """Return the outcomes of the first `count` lanes."""
    columns = [result.of(name)[:count].tolist() for name in _NUMBERS]
    return [_outcome(dict(zip(_NUMBERS, numbers, strict=True))) for numbers in zip(*columns, strict=True)]


def _outcome(end: Mapping[str, float]) -> RunOutcome:
    tripped = end["cause"] > 0.0
    return RunOutcome(
        periods=int(end["periods"]),
        tracking_rms_rad=_rms(end["tracking_squares"], end["tracking_cycles"]),
        tracking_max_rad=_known(end["tracking_max"], end["tracking_cycles"]),
        velocity_error_rms_rad_s=_rms(end["velocity_squares"], end["velocity_cycles"]),
        velocity_error_max_rad_s=_known(end["velocity_error_max"], end["velocity_cycles"]),
        disturbance_error_rms_rad_s2=_rms(end["disturbance_squares"], end["disturbance_cycles"]),
        voltage_peak_V=end["peak"],
        voltage_tv_V_s=end["variation"] / end["t"] if end["t"] > 0.0 else math.nan,
        tripped=tripped,
        trip_time_s=end["t"] if tripped else math.nan,
        trip_cause=_CAUSES[int(end["cause"])],
    )


def _rms(squares: float, cycles: float) -> float:
    return math.sqrt(squares / cycles) if cycles else math.nan


def _known(value: float, cycles: float) -> float:
    return value if cycles else math.nan


def likely_cause(rig: Rig, kept: NDArray[np.float64], periods: int) -> str:
    """Return the reason that the supervisor finds for unknown forces, from the last samples of a run.

    Parameters
    ----------
    rig
        That was run.
    kept
        Shape (samples, 3): t (s), position (rad) and voltage (V), a ring by the number of the cycle.
    periods
        Number of cycles that the run had.
    """
    size = len(kept)
    diagnosis = Diagnosis(rig.observer_context)
    for number in range(max(1, periods - size + 1), periods + 1):
        t, position, voltage = kept[number % size].tolist()
        diagnosis.add(Sample(t, position, voltage))
    return diagnosis.finding().reason


def samples_kept(rig: Rig) -> int:
    """Return how many samples the supervisor's diagnosis looks at."""
    return window_samples(rig.period)
