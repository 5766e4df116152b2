"""What the last samples look like: a motor that answers, a dead one, a reversed one, a blind encoder."""

from __future__ import annotations

import math
import random

import pytest

from dcmp_hil.safety.diagnosis import Diagnosis
from dcmp_hil.values import Sample
from tests.helpers import setting

T, KU, GRAVITY, COUNT = 1e-3, 5.4, 14.03, math.tau / 4096
CAUSES = {
    "push": ("disturbance", 1.0, 1.0, 80.0),
    "dead motor": ("power", 0.0, 1.0, 0.0),
    "reversed motor": ("polarity", -1.0, 1.0, 0.0),
    "reversed encoder": ("polarity", 1.0, -1.0, 0.0),
    "stuck encoder": ("stuck", 1.0, 0.0, 0.0),
}
"""By name: what is to be found; from then on the motor's gain, the encoder's, a push in rad/s2."""


def reason(cause: str, *, seed: int, lost: float = 0.0, period: float = T) -> str:
    """Move an arm, let something happen 20 to 120 ms before the end; return what it is taken for."""
    chance = random.Random(seed)
    diagnosis = Diagnosis(setting(period=period))
    _, motor, encoder, push = CAUSES[cause]
    x, v, shown = chance.uniform(-1.0, 1.0), chance.choice((-1, 1)) * chance.uniform(0.3, 1.0), 0.0
    onset = 0.2 - chance.uniform(0.02, 0.12)
    pull, turns = GRAVITY * math.sin(x) / KU, chance.uniform(20.0, 60.0)
    for k in range(round(0.2 / period)):
        t, faulty = k * period, k * period >= onset
        voltage = max(-10.0, min(10.0, pull + chance.uniform(-0.2, 0.2) + 6.0 * math.sin(turns * t)))
        force = KU * voltage * (motor if faulty else 1.0) + (push if faulty else 0.0)
        force -= GRAVITY * math.sin(x) + math.copysign(1.3, v)
        before, x, v = x, x + period * v + 0.5 * period * period * force, v + period * force
        shown += (x - before) * (encoder if faulty else 1.0)
        if chance.random() >= lost:
            diagnosis.add(Sample(t, COUNT * round(shown / COUNT), voltage))
    return diagnosis.finding().reason


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("cause", CAUSES)
def test_diagnosis_tells_the_cause(cause: str, seed: int) -> None:
    assert reason(cause, seed=seed) == CAUSES[cause][0]


@pytest.mark.parametrize("cause", CAUSES)
def test_diagnosis_tells_the_cause_when_samples_are_lost(cause: str) -> None:
    assert [reason(cause, seed=seed, lost=0.2) for seed in range(5)] == [CAUSES[cause][0]] * 5


@pytest.mark.parametrize("cause", CAUSES)
def test_diagnosis_tells_the_cause_at_ten_kilohertz(cause: str) -> None:
    assert [reason(cause, seed=seed, period=1e-4) for seed in range(3)] == [CAUSES[cause][0]] * 3


def test_position_that_never_changes_is_a_stuck_encoder() -> None:
    diagnosis = Diagnosis(setting())
    for k in range(100):
        diagnosis.add(Sample(k * T, 0.25, 0.1 * k))
    assert diagnosis.finding().reason == "stuck"


@pytest.mark.parametrize("positions", [[0.1, 0.2], [math.nan] * 50, [*[0.0] * 49, math.inf]])
def test_too_little_or_nonsense_is_no_diagnosis(positions: list[float]) -> None:
    diagnosis = Diagnosis(setting())
    for k, position in enumerate(positions):
        diagnosis.add(Sample(k * T, position, 1.0))
    assert diagnosis.finding().reason == "disturbance"
