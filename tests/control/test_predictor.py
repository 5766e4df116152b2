"""The prediction over the command under way, against scipy.linalg.expm and exact fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from dcmp_hil.control.model import Model
from dcmp_hil.control.predictor import LinearPredictor, held_input
from dcmp_hil.values import Estimate, Reference, Sample

_SAMPLE = Sample(1.0, 0.31, 0.0)
_ESTIMATE = Estimate(0.3, -0.7, 4.0)
_REFERENCE = Reference(0.0, 0.0, 0.0)  # the linear prediction needs none


@pytest.mark.parametrize("f0", [0.0, 1e-9, 0.1, 3.0, 100.0])  # 1/s
@pytest.mark.parametrize("period", [5e-5, 1e-3, 0.1])  # s
def test_predictor_equals_scipy_expm_when_a_command_is_under_way(f0: float, period: float) -> None:
    predictor = LinearPredictor(Model(f0=f0), period, 1)
    predictor.sent(-2.5)
    got = predictor.ahead(_SAMPLE, _ESTIMATE, _REFERENCE)
    drive = 4.0 - 5.4 * 2.5  # rad/s2: w + (ku/J) V, eq. (4)
    step = expm(period * np.array([[0.0, 1.0, 0.0], [0.0, -f0, 1.0], [0.0, 0.0, 0.0]]))
    expected = step @ [0.3, -0.7, drive]
    np.testing.assert_allclose(got[:2], expected[:2], rtol=1e-13, atol=1e-15)
    assert got.disturbance == 4.0


def test_predictor_sees_only_the_disturbance_when_nothing_was_sent_yet() -> None:
    got = LinearPredictor(Model(f0=0.0), 1e-3, 1).ahead(_SAMPLE, _ESTIMATE, _REFERENCE)
    assert tuple(got) == pytest.approx((0.3 - 0.7e-3 + 2e-6, -0.7 + 4e-3, 4.0), rel=1e-14, abs=0)


def test_predictor_forgets_all_but_the_newest_command() -> None:
    predictor, other = LinearPredictor(Model(), 1e-3, 1), LinearPredictor(Model(), 1e-3, 1)
    predictor.sent(9.0)
    predictor.sent(1.0)
    other.sent(1.0)
    assert predictor.ahead(_SAMPLE, _ESTIMATE, _REFERENCE) == other.ahead(_SAMPLE, _ESTIMATE, _REFERENCE)


def test_predictor_changes_nothing_when_the_command_acts_at_once() -> None:
    predictor = LinearPredictor(Model(), 1e-3, 0)
    predictor.sent(10.0)
    assert predictor.ahead(_SAMPLE, _ESTIMATE, _REFERENCE) == _ESTIMATE


def test_predictor_starts_from_the_encoder_when_measured() -> None:
    assert (
        LinearPredictor(Model(), 1e-3, 0, measured=True).ahead(_SAMPLE, _ESTIMATE, _REFERENCE).position
        == 0.31
    )
    carried = LinearPredictor(Model(), 1e-3, 1, measured=True).ahead(_SAMPLE, _ESTIMATE, _REFERENCE)
    quiet = LinearPredictor(Model(), 1e-3, 1).ahead(_SAMPLE, _ESTIMATE, _REFERENCE)
    assert carried.position - quiet.position == pytest.approx(0.01, rel=1e-12, abs=0)
    assert carried[1:] == quiet[1:]


@given(f0=st.floats(0.0, 100.0), period=st.floats(5e-5, 0.1))
def test_held_input_equals_its_exact_series(f0: float, period: float) -> None:
    # a = exp(-x), p1 = int exp(-f0 s), p2 = int p1, all as power series in exact fractions, x = f0 T <= 10
    x, t = Fraction(f0) * Fraction(period), Fraction(period)
    a = p1 = p2 = Fraction(0)
    term = Fraction(1)
    for k in range(80):
        a += term
        p1 += term / (k + 1)
        p2 += term / ((k + 1) * (k + 2))
        term = Fraction(-x * term / (k + 1)).limit_denominator(10**60)
    got = held_input(f0, period)
    assert got == pytest.approx((float(a), float(p1 * t), float(p2 * t * t)), rel=1e-12, abs=0)


@pytest.mark.parametrize("f0", [0.0, 1e-300, 1e-12, 1e-9, 1e-7, 1e-6, 1.1e-6])
def test_held_input_stays_exact_when_friction_is_tiny(f0: float) -> None:
    period = 1e-3
    _, p1, p2 = held_input(f0, period)
    x = f0 * period
    assert p1 == pytest.approx(period * (1 - x / 2 + x * x / 6), rel=1e-15, abs=0)
    assert p2 == pytest.approx(period**2 * (1 / 2 - x / 6 + x * x / 24), rel=1e-15, abs=0)
