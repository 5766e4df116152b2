"""The polarity probe: what it takes, and what it refuses and why."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.errors import TripError
from dcmp_hil.safety.polarity_check import PolarityCheck
from dcmp_hil.values import Event, ProbeData, Sample

T = 1e-3
KU = 5.4


def probe(
    gain: float = 1.0,
    *,
    count: float = 0.0,
    friction: float = 0.0,
    drift: float = 0.0,
    slew: float = math.inf,
    told: list[Event] | None = None,
) -> tuple[float, list[float]]:
    """Let a probe try a motor that is `gain` times what it believes; return the way it went, the voltages."""
    made = PolarityCheck(KU, 1.0, count, None if told is None else told.append)
    x = v = 0.0
    farthest = 0.0
    sent: list[float] = []
    applied = 0.0
    for k in range(2000):
        seen = count * round(x / count) if count else x
        stop = made.check(Sample(k * T, seen, applied))
        if stop is not None:
            raise stop.error()
        if made.over:
            return farthest, sent
        voltage = made.voltage
        sent.append(voltage)
        applied = voltage = max(applied - slew * T, min(applied + slew * T, voltage))
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
    made = PolarityCheck(KU, 1.0, 0.0)
    assert made.check(Sample(0.0, 0.0, 0.0)) is None
    assert made.check(Sample(T, math.nan, 0.0)) is not None


@pytest.mark.parametrize(("counts", "telling"), [(4096, True), (1000, True), (16, False)])
def test_probe_knows_when_the_encoder_is_too_coarse(counts: int, telling: bool) -> None:
    assert PolarityCheck(KU, 1.0, math.tau / counts).telling is telling


@pytest.mark.parametrize(
    ("gain", "level"),
    [(1.0, "INFO"), (1.15, "INFO"), (0.9, "INFO"), (1.4, "WARN"), (1.85, "WARN"), (0.6, "WARN")],
)
def test_probe_tells_the_motor_gain_and_warns_where_the_model_is_off(gain: float, level: str) -> None:
    told: list[Event] = []
    probe(gain, count=math.tau / 4096, told=told)
    (event,) = told
    assert event.level == level
    assert isinstance(event.data, ProbeData)
    assert event.data.ratio == pytest.approx(gain, rel=0.08)


@pytest.mark.parametrize("gain", [0.6, 1.0, 1.85])
@pytest.mark.parametrize("slew", [5.0, 10.0, 20.0, 50.0, 100.0, 1000.0])
def test_probe_judges_by_the_voltage_that_a_slow_amplifier_really_puts_out(gain: float, slew: float) -> None:
    told: list[Event] = []
    farthest, _ = probe(gain, count=math.tau / 4096, slew=slew, told=told)
    (event,) = told
    assert isinstance(event.data, ProbeData)
    assert event.data.ratio == pytest.approx(gain, rel=0.15)
    assert farthest <= 0.12
    with pytest.raises(TripError) as caught:
        probe(-gain, count=math.tau / 4096, slew=slew)
    assert caught.value.reason == "polarity"


def test_probe_names_the_slew_limit_where_too_little_voltage_came_out() -> None:
    with pytest.raises(TripError, match=r"put out 0\.1 V of the 1 V") as caught:
        probe(1.0, count=math.tau / 4096, friction=1.3, slew=1.0)
    assert caught.value.reason == "slew"
    with pytest.raises(TripError) as caught:  # all the voltage came out, and nothing moved
        probe(0.0, count=math.tau / 4096, slew=50.0)
    assert caught.value.reason == "power"
