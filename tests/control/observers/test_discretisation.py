"""The matched discretisation against the printed digits of theory.md section 4 and against scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.control.observers.discretisation import luenberger_copy, matched_gains
from tests.control.observers.matrix_observer import L1, L2, POLES, copy_step, gains, taylor


def test_copy_has_the_printed_digits_when_the_step_is_one_millisecond() -> None:
    got = luenberger_copy(1e-3, 0.1, L1, L2)
    printed = {  # theory.md, section 4, R1 step 2: as many digits as are printed there
        "f11": (0.995109239, 5e-10), "f12": (9.97503164e-4, 5e-13),
        "f21": (-5.49624243e-3, 5e-12), "f22": (0.999897255, 5e-10),
        "gu1": (4.99167458e-7, 5e-16), "gu2": (9.99949085e-4, 5e-13),
        "h01": (2.44384e-3, 5e-9), "h02": (2.74583e-3, 5e-9),
        "h11": (2.44692e-3, 5e-9), "h12": (2.75041e-3, 5e-9),
    }  # fmt: skip
    for name, (value, half_a_digit) in printed.items():
        assert getattr(got, name) == pytest.approx(value, rel=0, abs=1.01 * half_a_digit), name


@pytest.mark.parametrize("dt", [5e-5, 1e-4, 1e-3, 3e-3, 1e-2, 0.1, 1.0])  # s
@pytest.mark.parametrize("f0", [0.0, 0.1, 30.0])  # 1/s
def test_copy_equals_scipy_expm(dt: float, f0: float) -> None:
    f, gu, h0, h1 = copy_step(dt, f0)
    expected = [*f[0], *f[1], *gu, *h0, *h1]
    # H0 = E - H1 and E / dt lose digits against the norm of E, about 1: absolute at 1e-15 of that.
    np.testing.assert_allclose(luenberger_copy(dt, f0, L1, L2), expected, rtol=1e-10, atol=1e-15)


@given(
    dt=st.floats(1e-6, 0.2),
    f0=st.sampled_from([0.0, 0.1, 30.0, 100.0]),
    gain1=st.floats(1e-3, 200.0),
    gain2=st.floats(1e-3, 5000.0),
)
def test_copy_of_any_step_is_that_of_the_matrix_exponential(
    dt: float, f0: float, gain1: float, gain2: float
) -> None:
    f, gu, h0, h1 = copy_step(dt, f0, gain1, gain2)
    got, expected = luenberger_copy(dt, f0, gain1, gain2), [*f[0], *f[1], *gu, *h0, *h1]
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-14 * (1.0 + gain2))


def test_gains_have_the_printed_digits_when_x_is_four_hundredths() -> None:
    printed = (0.07688365361336419, 0.003261425675149248, 6.76384823927754e-5)  # theory.md, section 5
    assert tuple(matched_gains(0.04)) == pytest.approx(printed, rel=1e-12, abs=0)


@pytest.mark.parametrize("x", [50.0, 1e3, 1e300, math.inf])
def test_gains_reach_deadbeat_when_x_is_fifty_or_more(x: float) -> None:
    assert tuple(matched_gains(x)) == pytest.approx((1.0, 1.5, 1.0), abs=1e-9)


def test_gains_vanish_when_x_is_zero() -> None:
    assert tuple(matched_gains(0.0)) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("x", [0.01, 0.04, 0.3, 1.0, 3.0, 10.0])
def test_gains_put_the_error_poles_at_the_matched_places(x: float) -> None:
    k = np.array(matched_gains(x))
    poles = np.linalg.eigvals((np.eye(3) - np.outer(k, [1.0, 0.0, 0.0])) @ taylor(1.0))
    # A triple pole near 1 spreads by the cube root of the rounding: 1e-9 x^-2 is far from a wrong gain.
    for wanted in np.exp(POLES * x):
        assert np.abs(poles - wanted).min() < 1e-5 * min(1.0, x), x


@given(st.floats(0.005, 60.0))
def test_gains_equal_ackermanns_formula(x: float) -> None:
    np.testing.assert_allclose(matched_gains(x), gains(x), rtol=1e-7, atol=1e-13)


def test_gains_are_nan_when_x_is_nan() -> None:
    assert all(math.isnan(k) for k in matched_gains(math.nan))
