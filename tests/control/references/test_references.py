"""Every kind of reference: its derivatives, its ends, its limits."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.signal import chirp

from dcmp_hil.control.references.periodic import Chirp, Sine
from dcmp_hil.control.references.piecewise import Hold, Step, Trapezoid, trapezoid
from dcmp_hil.control.references.table import Table
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.control.references import ReferenceSource

_H = 1e-5  # s, half the span of a finite difference

_sines = st.builds(
    Sine,
    amplitude_rad=st.floats(0.0, 3.0),
    rate_rad_s=st.floats(0.01, 20.0),
    phase_rad=st.floats(-7.0, 7.0),
    offset_rad=st.floats(-3.0, 3.0),
)
_chirps = st.builds(
    Chirp,
    kind=st.just("chirp"),
    amplitude_rad=st.floats(0.0, 1.0),
    from_hz=st.floats(0.0, 3.0),
    to_hz=st.floats(0.01, 3.0),
    sweep_s=st.floats(0.5, 40.0),
    offset_rad=st.floats(-3.0, 3.0),
)
_trapezoids = st.builds(
    Trapezoid,
    kind=st.just("trapezoid"),
    low_rad=st.floats(-3.0, 3.0),
    high_rad=st.floats(-3.0, 3.0),
    velocity_rad_s=st.floats(0.05, 10.0),
    acceleration_rad_s2=st.floats(0.05, 50.0),
    rest_s=st.floats(0.0, 2.0),
)


def _check_derivatives(source: ReferenceSource, t: float, scale: float) -> None:
    """Compare with finite differences; at a kink the difference lies between the two sides."""
    before, now, after = source.at(t - _H), source.at(t), source.at(t + _H)
    velocity = (after.position - before.position) / (2 * _H)
    lowest = min(before.velocity, now.velocity, after.velocity)
    highest = max(before.velocity, now.velocity, after.velocity)
    assert lowest - 1e-6 * scale <= velocity <= highest + 1e-6 * scale
    acceleration = (after.velocity - before.velocity) / (2 * _H)
    lowest = min(before.acceleration, now.acceleration, after.acceleration)
    highest = max(before.acceleration, now.acceleration, after.acceleration)
    assert lowest - 1e-4 * scale <= acceleration <= highest + 1e-4 * scale


@given(source=_sines, t=st.floats(0.0, 60.0))
def test_sine_has_the_derivatives_of_its_position(source: Sine, t: float) -> None:
    _check_derivatives(source, t, 1.0 + source.rate_rad_s**3)


@given(source=_chirps, t=st.floats(0.1, 60.0))
def test_chirp_has_the_derivatives_of_its_position(source: Chirp, t: float) -> None:
    _check_derivatives(source, t, 1.0 + (2 * math.pi * 3.0) ** 3)


@given(source=_trapezoids, t=st.floats(0.1, 60.0))
def test_trapezoid_has_the_derivatives_of_its_position(source: Trapezoid, t: float) -> None:
    assume(abs(source.high_rad - source.low_rad) > 0.01)  # or a whole move fits between the differences
    _check_derivatives(source, t, 1.0 + source.acceleration_rad_s2)


def test_sine_is_the_papers_when_nothing_is_said() -> None:
    for t in (0.0, 1.0, 7.7):
        assert Sine().at(t).position == pytest.approx(math.sin(t / 2), abs=1e-15)


@given(source=_chirps, part=st.floats(0.0, 1.0))
def test_chirp_equals_scipys_while_it_sweeps(source: Chirp, part: float) -> None:
    t = part * source.sweep_s
    expected = source.amplitude_rad * chirp(t, source.from_hz, source.sweep_s, source.to_hz, phi=-90)
    assert source.at(t).position - source.offset_rad == pytest.approx(float(expected), abs=1e-9)


@given(source=_chirps)
def test_chirp_goes_on_without_a_jump_when_the_sweep_ends(source: Chirp) -> None:
    end = source.sweep_s
    before, after = source.at(end * (1 - 1e-12)), source.at(end)
    assert after.position == pytest.approx(before.position, abs=1e-8)
    assert after.velocity == pytest.approx(before.velocity, abs=1e-7)
    period = 1.0 / source.to_hz  # from here on the frequency stays
    assert source.at(end + 3 * period).position == pytest.approx(after.position, abs=1e-8)
    assert source.at(end + 3 * period).velocity == pytest.approx(after.velocity, abs=1e-7)


@given(source=_trapezoids)
def test_trapezoid_stays_inside_its_limits_and_reaches_both_ends(source: Trapezoid) -> None:
    low, high = sorted((source.low_rad, source.high_rad))
    distance, v, a = high - low, source.velocity_rad_s, source.acceleration_rad_s2
    ramp = min(v / a, math.sqrt(distance / a))  # textbook: full speed, or a triangle
    move = 2 * ramp + (distance / v - v / a if v * v < a * distance else 0.0) if distance else 0.0
    for part in np.linspace(0.0, 2.0 * (move + source.rest_s), 41):
        x, speed, slope = source.at(float(part))
        assert low - 1e-9 <= x <= high + 1e-9
        assert abs(speed) <= v * (1 + 1e-9)
        assert abs(slope) <= a * (1 + 1e-9)
    assert source.at(0.0).position == pytest.approx(source.low_rad, abs=1e-9)
    middle_of_rest = move + 0.5 * source.rest_s
    assert source.at(middle_of_rest).position == pytest.approx(source.high_rad, abs=1e-8)
    back = 2 * move + 1.5 * source.rest_s
    assert source.at(back).position == pytest.approx(source.low_rad, abs=1e-8)


def test_trapezoid_takes_the_textbook_time() -> None:
    # 2 rad at 1 rad/s and 4 rad/s2: 0.25 s up, 1.75 s at full speed, 0.25 s down; 0.5 s of rest
    source = Trapezoid(kind="trapezoid", low_rad=-1.0, high_rad=1.0, rest_s=0.5)
    assert tuple(source.at(0.1)) == pytest.approx((-1.0 + 0.5 * 4 * 0.01, 0.4, 4.0), rel=1e-12)
    assert tuple(source.at(1.125)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    assert tuple(source.at(2.15)) == pytest.approx((1.0 - 0.5 * 4 * 0.01, 0.4, -4.0), rel=1e-9)
    assert tuple(source.at(2.5)) == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)
    assert source.at(2.75 + 1.125).velocity == pytest.approx(-1.0, rel=1e-12)


def test_trapezoid_holds_when_both_ends_are_the_same() -> None:
    source = Trapezoid(kind="trapezoid", low_rad=0.3, high_rad=0.3)
    assert source.at(5.0) == (0.3, 0.0, 0.0)


@pytest.mark.parametrize("source", [Trapezoid(kind="trapezoid"), Hold(kind="hold"), Sine(amplitude_rad=0.0)])
def test_reference_rests_before_its_start(source: ReferenceSource) -> None:
    assert source.at(-1.0)[1:] == (0.0, 0.0)


@pytest.mark.parametrize(
    ("s", "expected"),
    [(-1.0, (0.0, 0.0, 0.0)), (0.0, (0.0, 0.0, 0.0)), (0.5, (0.5, 1.5, 0.0)), (2.0, (1.0, 0.0, 0.0))],
)
def test_unit_trapezoid_rests_outside_and_is_symmetric(s: float, expected: tuple[float, ...]) -> None:
    assert trapezoid(s, 1.0 / 3.0) == pytest.approx(expected, abs=1e-15)  # top speed 1/(1 - 1/3)


def test_hold_and_step_have_no_derivatives() -> None:
    assert Hold(kind="hold", position_rad=-0.2).at(3.0) == (-0.2, 0.0, 0.0)
    step = Step(kind="step", before_rad=0.1, after_rad=0.9, at_s=2.0)
    assert step.at(1.999999) == (0.1, 0.0, 0.0)
    assert step.at(2.0) == (0.9, 0.0, 0.0)


def _table(path: Path, rows: list[tuple[float, float]]) -> Table:
    file = path / "reference.csv"
    text = "\n".join(["time_s,position_rad", *(f"{t!r},{x!r}" for t, x in rows)])
    file.write_text(text + "\n", encoding="utf-8")
    return Table(kind="csv", file=str(file))


def test_table_goes_through_its_points_and_is_smooth_between_them(tmp_path: Path) -> None:
    rows = [(5.0, 0.2), (5.5, 0.9), (6.5, -0.4), (7.0, -0.1), (9.0, 1.0)]  # time need not begin at 0
    source = _table(tmp_path, rows)
    for t, x in rows:
        assert source.at(t - 5.0).position == pytest.approx(x, abs=1e-12)
    for t in np.arange(0.05, 3.95, 0.1):
        _check_derivatives(source, float(t), 10.0)
    for (before, _), (knot, _) in itertools.pairwise([(t - 5.0, x) for t, x in rows[:-1]]):
        assert before < knot
        left, right = source.at(knot - 1e-9), source.at(knot + 1e-9)
        assert right == pytest.approx(left, abs=1e-6), "twice differentiable"


def test_table_rests_at_both_ends_and_holds_after_them(tmp_path: Path) -> None:
    source = _table(tmp_path, [(0.0, 0.2), (1.0, 0.9), (2.0, -0.4)])
    assert source.at(0.0).velocity == pytest.approx(0.0, abs=1e-12)
    assert source.at(2.0).velocity == pytest.approx(0.0, abs=1e-12)
    assert tuple(source.at(-0.1)) == pytest.approx((0.2, 0.0, 0.0), abs=1e-12)
    assert tuple(source.at(50.0)) == pytest.approx((-0.4, 0.0, 0.0), abs=1e-12)


def test_table_takes_the_cubic_when_there_are_two_points(tmp_path: Path) -> None:
    # At rest at both ends: x = 3 s^2 - 2 s^3 between 0 and 1.
    source = _table(tmp_path, [(0.0, 0.0), (2.0, 1.0)])
    assert tuple(source.at(0.5)) == pytest.approx((3 / 16 - 2 / 64, 1.125 / 2, 3.0 / 4), rel=1e-12)


def test_table_is_refused_when_it_has_one_point(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="at least two rows"):
        _table(tmp_path, [(0.0, 0.0)]).at(0.0)
