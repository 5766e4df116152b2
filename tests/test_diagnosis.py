"""What the last samples look like: a motor that answers, a dead one, a reversed one, a blind encoder."""

from __future__ import annotations

import math
import random

import pytest

from dcmp_hil.diagnosis import Diagnosis
from dcmp_hil.values import Sample

T, KU, COUNT = 1e-3, 5.4, math.tau / 4096


def reason(gain: float, *, lost: float = 0.0, seed: int = 1) -> str:
    """Move an arm by `gain` times the believed motor, under a push and quantised; ask why."""
    chance = random.Random(seed)
    diagnosis = Diagnosis(KU, T)
    x, v = 0.3, chance.uniform(-0.5, 0.5)
    for k in range(200):
        voltage = 8.0 * math.sin(0.1 * k + seed)
        x += T * v + 0.5 * T * T * (gain * KU * voltage - 4.0)
        v += T * (gain * KU * voltage - 4.0)
        if chance.random() >= lost:
            diagnosis.add(Sample(k * T, COUNT * round(x / COUNT), voltage))
    return diagnosis.finding().reason


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize(("gain", "expected"), [(1.0, "disturbance"), (0.0, "power"), (-1.0, "polarity")])
def test_gain_tells_the_cause(seed: int, gain: float, expected: str) -> None:
    assert reason(gain, seed=seed) == expected


def test_position_that_never_changes_is_a_stuck_encoder() -> None:
    diagnosis = Diagnosis(KU, T)
    for k in range(100):
        diagnosis.add(Sample(k * T, 0.25, 0.1 * k))
    assert diagnosis.finding().reason == "stuck"


@pytest.mark.parametrize("positions", [[0.1, 0.2], [math.nan] * 50, [*[0.0] * 49, math.inf]])
def test_too_little_or_nonsense_is_no_diagnosis(positions: list[float]) -> None:
    diagnosis = Diagnosis(KU, T)
    for k, position in enumerate(positions):
        diagnosis.add(Sample(k * T, position, 1.0))
    assert diagnosis.finding().reason == "disturbance"
