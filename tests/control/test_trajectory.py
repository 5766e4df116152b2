"""The beginning and the end of a trajectory."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.control.references.periodic import Sine
from dcmp_hil.control.trajectory import LOWERING_TIME_S, Trajectory
from dcmp_hil.values import Reference
from tests.helpers import figures, known

_H = 1e-5  # s


def _begun(soft_start: float = 2.0, *, t0: float = 0.25, x0: float = -1.57) -> Trajectory:
    trajectory = Trajectory(Sine(), soft_start)
    trajectory.begin(t0, x0)
    return trajectory


def test_trajectory_holds_until_it_begins() -> None:
    trajectory = Trajectory(Sine(phase_rad=1.0), 2.0)
    assert trajectory.at(0.1) == trajectory.at(7.0)
    assert trajectory.at(7.0)[1:] == (0.0, 0.0)


@pytest.mark.parametrize("soft_start", [0.0, 0.5])
def test_trajectory_counts_time_from_where_it_began(soft_start: float) -> None:
    trajectory = _begun(soft_start, t0=3.0)
    assert trajectory.at(4.0) == Sine().at(1.0)


def test_soft_start_begins_at_the_arm_at_rest() -> None:
    # b = 1, b' = b'' = 0 at s = 0: position x0, and no velocity nor acceleration of x_r gets through
    assert tuple(_begun().at(0.25)) == pytest.approx((-1.57, 0.0, 0.0), abs=1e-15)


def test_soft_start_ends_on_the_reference() -> None:
    just_before = _begun().at(2.25 - 1e-7)
    assert tuple(just_before) == pytest.approx(tuple(Sine().at(2.0)), abs=1e-5)
    assert _begun().at(2.25) == Sine().at(2.0)


@given(st.floats(0.0, 1.0))
def test_soft_start_follows_its_polynomial(s: float) -> None:
    b = 1.0 - (10 * s**3 - 15 * s**4 + 6 * s**5)  # theory.md, section 4, Controller; s = t / 2 s
    t = 2.0 * s
    expected = -1.57 * b + (1.0 - b) * math.sin(0.5 * t)
    assert _begun().at(0.25 + t).position == pytest.approx(expected, abs=1e-12)


@given(st.floats(0.3, 3.0))
def test_soft_start_has_the_derivatives_of_its_position(t: float) -> None:
    trajectory = _begun()
    before, now, after = (trajectory.at(t + h) for h in (-_H, 0.0, _H))
    assert now.velocity == pytest.approx((after.position - before.position) / (2 * _H), abs=1e-7)
    assert now.acceleration == pytest.approx((after.velocity - before.velocity) / (2 * _H), abs=1e-3)


def test_soft_start_needs_five_volts_instead_of_a_thousand() -> None:
    # theory.md, section 4: "peak about 5 V instead of 1175 V", and section 5: V peak < 6
    assert 4.5 < known(figures(duration=3.0, window_from=0.0).voltage_peak_V) < 6.0


def test_lowering_starts_where_the_reference_was_and_ends_hanging_at_rest() -> None:
    trajectory = _begun()
    start = 30.0
    there = trajectory.at(start).position
    trajectory.lower(start)
    assert trajectory.at(start).position == pytest.approx(there, abs=1e-12)
    assert trajectory.at(start + 1e-9).position == pytest.approx(there, abs=1e-8)
    assert trajectory.at(start + LOWERING_TIME_S) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert trajectory.at(start + 10 * LOWERING_TIME_S) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert trajectory.at(start - 0.5) == _begun().at(start - 0.5), "the past stays what it was"


@pytest.mark.parametrize("start", [3.0, 0.25 + 4.0 * math.pi, 11.0, 30.0])  # s
def test_lowering_moves_without_a_jump(start: float) -> None:
    trajectory = _begun()
    trajectory.lower(start)
    h = LOWERING_TIME_S / 4000
    for k in range(-20, 4020):
        before, now, after = (trajectory.at(start + (k + i) * h) for i in (-1, 0, 1))
        # Less than 5 rad/s2 and 50 rad/s3 anywhere, so one step of 0.5 ms changes no more than this:
        assert abs(after.velocity - before.velocity) < 5.0 * 2 * h
        assert now.velocity == pytest.approx((after.position - before.position) / (2 * h), abs=1e-5)
        mean = 0.5 * (after.acceleration + before.acceleration)
        assert (after.velocity - before.velocity) / (2 * h) == pytest.approx(mean, abs=2e-2)


def test_lowering_does_not_jump_in_velocity_when_the_arm_moves() -> None:
    # 130 1/s x 0.5 rad/s / 5.4 = 12 V: a jump of the reference's whole velocity saturates the amplifier.
    trajectory = _begun()
    start = 0.25 + 4.0 * math.pi  # x_r = 0, x_r' = 0.5 rad/s
    before = trajectory.at(start - 1e-9)
    trajectory.lower(start)
    assert trajectory.at(start + 1e-9).velocity == pytest.approx(before.velocity, abs=1e-6)


def test_trajectory_stays_where_it_is_held_until_it_begins() -> None:
    trajectory = Trajectory(Sine(), 2.0)
    trajectory.hold(0.3)
    assert trajectory.at(7.0) == Reference(0.3, 0.0, 0.0)
    trajectory.begin(7.0, 0.4)
    assert trajectory.at(7.0).position == pytest.approx(0.4)
