"""The reference governor: identity where the arm can follow, and a way inside the limits where it cannot."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.control.references.periodic import Sine
from dcmp_hil.safety.reference_governor import Bounds, ReferenceGovernor
from dcmp_hil.values import Reference

T = 1e-3
BOUNDS = Bounds(5.969, 19.0, 44.8, 27.0, 54.0)


def _led(source: Sine | None, periods: int = 4000, jumps: dict[int, float] | None = None) -> list[Reference]:
    governor, found, target = ReferenceGovernor(BOUNDS), [], 0.0
    for k in range(periods):
        target = (jumps or {}).get(k, target)
        asked = source.at(k * T) if source else Reference(target, 0.0, 0.0)
        found.append(governor.bound(k * T, asked))
    return found


@pytest.mark.parametrize(("amplitude", "rate"), [(1.0, 0.5), (5.96, 0.5), (1.0, 6.5), (0.04, 30.0)])
def test_reference_that_the_arm_can_follow_passes_to_the_bit(amplitude: float, rate: float) -> None:
    source, governor = Sine(amplitude_rad=amplitude, rate_rad_s=rate), ReferenceGovernor(BOUNDS)
    for k in range(4000):
        asked = source.at(k * T)
        assert governor.bound(k * T, asked) is asked


@settings(max_examples=60, deadline=None)
@given(
    amplitude=st.floats(0.0, 1e4),
    rate=st.floats(1e-6, 1e4),
    offset=st.floats(-1e4, 1e4),
    phase=st.floats(-10.0, 10.0),
)
def test_no_reference_leads_beyond_the_bounds(
    amplitude: float, rate: float, offset: float, phase: float
) -> None:
    source = Sine(amplitude_rad=amplitude, rate_rad_s=rate, offset_rad=offset, phase_rad=phase)
    way = _led(source, 1500)
    assert max(abs(one.position) for one in way) <= BOUNDS.position + 1e-9
    assert max(abs(one.velocity) for one in way) <= BOUNDS.velocity + 1e-9
    for one, following in pairwise(way[1:]):
        # no faster than the bound from one period to the next, and no stop that the bound does not allow
        assert abs(following.position - one.position) <= BOUNDS.velocity * T * 1.01
    assert max(abs(one.acceleration) for one in way) <= BOUNDS.acceleration + 1e-9


def test_hold_at_the_limit_is_a_stop_and_not_a_blow() -> None:
    way = _led(Sine(amplitude_rad=200.0, rate_rad_s=0.5, phase_rad=0.0), 3000)
    assert max(one.position for one in way) == pytest.approx(BOUNDS.position, abs=0.05)
    hardest = max(abs(b.velocity - a.velocity) / T for a, b in pairwise(way[300:]))
    assert hardest <= BOUNDS.acceleration


@pytest.mark.parametrize("target", [5.0, -5.9, 50.0])
def test_large_step_is_led_and_arrives(target: float) -> None:
    way = _led(None, 4000, {500: target})
    assert max(abs(one.velocity) for one in way) < 12.0
    assert way[-1].position == pytest.approx(max(-BOUNDS.position, min(BOUNDS.position, target)), abs=2e-3)


def test_small_step_is_left_to_the_controller() -> None:
    way = _led(None, 1000, {500: 0.5})
    assert way[499].position == 0.0
    assert way[500] == Reference(0.5, 0.0, 0.0)


def test_reference_takes_over_where_both_meet() -> None:
    source = Sine(amplitude_rad=7.0, rate_rad_s=0.5)
    governor = ReferenceGovernor(BOUNDS)
    led = []
    for k in range(12_000):
        governor.bound(k * T, source.at(k * T))
        led.append(governor.leads)
    assert any(led[2000:4000])
    assert not any(led[6000:7000])


@pytest.mark.parametrize("field", ["position", "velocity", "acceleration"])
def test_nan_stays_and_does_not_spoil_what_follows(field: str) -> None:
    governor = ReferenceGovernor(BOUNDS)
    fine = Reference(0.1, 0.0, 0.0)
    governor.bound(0.0, fine)
    assert math.isnan(getattr(governor.bound(T, fine._replace(**{field: math.nan})), field))
    assert governor.bound(2 * T, fine) == fine
