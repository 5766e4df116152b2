"""The polarity probe: what it takes, and what it refuses and why."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.errors import TripError
from dcmp_hil.probe import Probe

T = 1e-3
KU = 5.4


def probe(
    gain: float = 1.0, *, count: float = 0.0, friction: float = 0.0, drift: float = 0.0
) -> tuple[float, list[float]]:
    """Let a probe try a motor that is `gain` times what it believes; return the way it went, the voltages."""
    made = Probe(KU, 1.0, count)
    x = v = 0.0
    farthest = 0.0
    sent: list[float] = []
    for k in range(2000):
        seen = count * round(x / count) if count else x
        voltage = made.voltage_at(k * T, seen)
        if voltage is None:
            return farthest, sent
        sent.append(voltage)
        v += T * (gain * KU * voltage + drift)
        v = math.copysign(max(0.0, abs(v) - T * friction), v)
        x += T * v
        farthest = max(farthest, abs(x))
    raise AssertionError("the probe never ended")


@pytest.mark.parametrize("gain", [0.4, 0.6, 1.0, 1.5, 2.5])
@pytest.mark.parametrize("count", [0.0, math.tau / 4096, math.tau / 1000])
def test_probe_passes_a_motor_that_is_about_as_strong_as_believed(gain: float, count: float) -> None:
    farthest, sent = probe(gain, count=count, friction=1.3 if gain > 0.5 else 0.0)
    assert farthest < 0.1
    assert set(sent) == {0.0, 1.0, -1.0}
    assert sent.count(1.0) == pytest.approx(sent.count(-1.0), abs=1)
    assert len(sent) <= 302


@pytest.mark.parametrize(
    ("gain", "reason"), [(-1.0, "polarity"), (-0.4, "polarity"), (0.0, "power"), (0.1, "gain"), (8.0, "gain")]
)
def test_probe_refuses_a_rig_that_is_not_what_the_file_says(gain: float, reason: str) -> None:
    with pytest.raises(TripError) as caught:
        probe(gain)
    assert caught.value.reason == reason


@pytest.mark.parametrize("drift", [0.0, 0.5, -0.5])
def test_probe_is_not_misled_by_a_push_that_stays(drift: float) -> None:
    # up to where the arm still counts as being at rest
    probe(1.0, drift=drift)
    with pytest.raises(TripError, match="wrong way"):
        probe(-1.0, drift=drift)


@pytest.mark.parametrize("drift", [6.0, -6.0])
def test_probe_refuses_an_arm_that_moves_by_itself(drift: float) -> None:
    with pytest.raises(TripError) as caught:
        probe(drift=drift)
    assert caught.value.reason == "moving"


def test_probe_refuses_nan() -> None:
    made = Probe(KU, 1.0, 0.0)
    made.voltage_at(0.0, 0.0)
    with pytest.raises(TripError):
        made.voltage_at(T, math.nan)


@pytest.mark.parametrize(("counts", "telling"), [(4096, True), (1000, True), (16, False)])
def test_probe_knows_when_the_encoder_is_too_coarse(counts: int, telling: bool) -> None:
    assert Probe(KU, 1.0, math.tau / counts).telling is telling
