"""The elementary functions against 60 digits, at their limits, and the gains and the copy made of them."""

from __future__ import annotations

import math
import random
from decimal import Decimal, localcontext
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.control.elementary import cosine, expm1, exponential, inverse_cube_root, logarithm, sine
from dcmp_hil.control.observers.discretisation import luenberger_copy, matched_gains
from dcmp_hil.control.observers.super_twisting import SuperTwisting, bandwidth_floor
from dcmp_hil.values import Sample
from tests.helpers import setting

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

DIGITS = 60
DRAWN = 150  # arguments of each range
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534")
ROOT_R, ROOT_A, ROOT_C = (
    Decimal(root) for root in (0.9806592527262586, 0.5096703736368707, 0.9284021317842834)
)


@pytest.fixture(autouse=True)
def _digits() -> Iterator[None]:
    with localcontext() as context:
        context.prec = DIGITS + 20
        yield


def exact_sine(x: Decimal) -> Decimal:
    """Return sin x by its series, after whole turns are taken off."""
    turn = 2 * PI
    x -= turn * (x / turn).to_integral_value()
    term = total = x
    k = 1
    while abs(term) > Decimal(10) ** -DIGITS:
        k += 2
        term *= -x * x / (k * (k - 1))
        total += term
    return total


def exact_cosine(x: Decimal) -> Decimal:
    return exact_sine(PI / 2 - x)


def exact_root(x: Decimal) -> Decimal:
    return Decimal(1) / (x.ln() / 3).exp()


def units(found: float, exact: Decimal) -> float:
    """Return by how many units in the last place a number is off."""
    return float(abs(Decimal(found) - exact) / Decimal(math.ulp(float(exact))))


def drawn(*sizes: float) -> list[float]:
    """Return arguments of both signs, even within each size."""
    draw = random.Random(5)
    return [draw.uniform(-size, size) for size in sizes for _ in range(DRAWN)]


@pytest.mark.parametrize(
    ("function", "exact", "given"),
    [
        (sine, exact_sine, drawn(1e-9, 1e-3, 1.57, 7.0, 1e3, 1e6)),
        (expm1, lambda x: x.exp() - 1, drawn(1e-12, 1e-3, 0.35, 5.0, 50.0, 700.0)),
        (exponential, lambda x: x.exp(), drawn(1e-12, 1e-3, 0.35, 5.0, 50.0, 700.0)),
        (inverse_cube_root, exact_root, [10.0**x for x in drawn(1.0, 30.0, 307.0)]),
        (logarithm, lambda x: x.ln(), [10.0**x for x in drawn(0.1, 1.0, 30.0, 307.0)]),
    ],
    ids=["sine", "expm1", "exponential", "inverse_cube_root", "logarithm"],
)
def test_function_is_right_to_two_units_in_the_last_place(
    function: Callable[[float], float], exact: Callable[[Decimal], Decimal], given: list[float]
) -> None:
    assert max(units(function(x), exact(Decimal(x))) for x in given) <= 2.0


def test_cosine_is_right_to_half_a_unit_of_its_argument() -> None:
    for x in drawn(1e-3, 1.57, 7.0, 1e3):
        off = abs(Decimal(cosine(x)) - exact_cosine(Decimal(x)))
        assert off <= Decimal("2.3e-16") + Decimal(math.ulp(x)) / 2


def test_functions_have_their_exact_values() -> None:
    assert [sine(0.0), expm1(0.0), cosine(0.0), exponential(0.0)] == [0.0, 0.0, 1.0, 1.0]
    assert [inverse_cube_root(8.0**k) for k in range(-5, 6)] == [2.0**-k for k in range(-5, 6)]


@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf])
def test_sine_and_cosine_are_nan_where_the_argument_is_not_finite(x: float) -> None:
    assert math.isnan(sine(x))
    assert math.isnan(cosine(x))


def test_sine_is_odd_and_none_beyond_its_limit() -> None:
    assert all(sine(-x) == -sine(x) for x in drawn(1.57, 10.0, 1e6))
    assert abs(sine(math.nextafter(2.0**30, 0.0))) <= 1.0
    assert [sine(2.0**30), sine(-1e300)] == [0.0, 0.0]


def test_exponentials_are_limited_at_seven_hundred() -> None:
    assert exponential(math.inf) == exponential(1e300) == exponential(700.0)
    assert exponential(-math.inf) == exponential(-1e300) == exponential(-700.0)
    assert expm1(-math.inf) == -1.0
    assert expm1(math.inf) == expm1(700.0)
    assert math.isnan(exponential(math.nan))
    assert math.isnan(expm1(math.nan))
    assert math.isnan(inverse_cube_root(math.nan))


@pytest.mark.parametrize("edge", [math.pi / 2, 0.34, 0.5 * math.log(2.0), 1.5 * math.pi])
def test_short_and_long_ways_meet(edge: float) -> None:
    near = [edge, -edge]
    for _ in range(5):
        near += [math.nextafter(near[-2], 9.0), math.nextafter(near[-1], -9.0)]
    for x in near:
        exact = Decimal(x)
        assert units(sine(x), exact_sine(exact)) <= 2.0
        assert units(expm1(x), exact.exp() - 1) <= 2.0
        assert units(exponential(x), exact.exp()) <= 2.0


def exact_gains(x: float) -> tuple[Decimal, Decimal, Decimal]:
    """Return the gains of theory.md from the poles, by 1 - 2 q + m."""
    at = Decimal(x)
    d, m = 1 - (-ROOT_R * at).exp(), (-2 * ROOT_A * at).exp()
    q = (-ROOT_A * at).exp() * exact_cosine(ROOT_C * at)
    e1, e0 = 2 - 2 * q, 1 - 2 * q + m
    p1, p3 = d + e1, d * e0
    p2 = d * e1 + e0 - p3 / 2
    return p1 - p2 + p3 / 2, p2 - p3, p3


@pytest.mark.parametrize("x", [1e-6, 1e-4, 1e-3, 0.01, 0.04, 0.1, 0.3, 0.7, 1.0, 2.0, 5.0, 12.0, 30.0, 50.0])
def test_gains_lose_no_digits(x: float) -> None:
    for found, exact in zip(matched_gains(x), exact_gains(x), strict=True):
        assert abs(Decimal(found) / exact - 1) < Decimal("2e-15")


@pytest.mark.parametrize("dt", [1e-4, 1e-3, 0.01, 0.1])  # s
def test_the_copy_in_differences_is_the_copy(dt: float) -> None:
    copy = luenberger_copy(dt, 0.1, 4.9, 5.51)
    f12, f22, gu1, gu2, h01, h02, h11, h12 = copy.differences()
    assert (f12, f22, gu1, gu2) == (copy.f12, copy.f22, copy.gu1, copy.gu2)
    assert 1.0 - h01 - h11 == pytest.approx(copy.f11, rel=0, abs=4e-16)
    assert -h02 - h12 == pytest.approx(copy.f21, rel=1e-12, abs=0)
    draw = random.Random(6)
    for _ in range(50):
        z1, z2, u, y0, y = (draw.uniform(-3.0, 3.0) for _ in range(5))
        e0, e1 = y0 - z1, y - z1
        first = copy.f11 * z1 + f12 * z2 + gu1 * u + h01 * y0 + h11 * y
        second = copy.f21 * z1 + f22 * z2 + gu2 * u + h02 * y0 + h12 * y
        assert z1 + (h01 * e0 + h11 * e1 + f12 * z2 + gu1 * u) == pytest.approx(first, rel=0, abs=4e-15)
        assert f22 * z2 + gu2 * u + h02 * e0 + h12 * e1 == pytest.approx(second, rel=0, abs=4e-15)


@pytest.mark.parametrize("y", [0.1, -1.57, 3.3e5])  # rad
def test_an_arm_at_rest_is_a_rest_to_the_last_bit(y: float) -> None:
    observer = SuperTwisting(setting())
    for k in range(3000):
        assert observer.update(Sample(1e-3 * k, y, 0.0)) == (y, 0.0, 0.0)


@pytest.mark.parametrize("M", [0.0, 1e-40, 15.0])  # rad/s3
@pytest.mark.parametrize("mu0", [0.0, 40.0])  # rad/s
def test_a_position_that_is_no_number_leaves_none_and_raises_nothing(M: float, mu0: float) -> None:
    observer = SuperTwisting(setting(), M=M, mu0=mu0)
    observer.update(Sample(0.0, 0.1, 0.0))
    assert all(math.isnan(value) for value in observer.update(Sample(1e-3, math.nan, 0.0)))


def test_the_rule_of_the_floor_has_its_value_at_the_bench() -> None:
    assert bandwidth_floor(4096.0, 1e-3) == 40.0
    for counts, period in ((2000.0, 1e-3), (65536.0, 5e-4), (4096.0, 4e-3)):
        usual = 40.0 * (counts / 4096.0) ** (1 / 3) * (1e-3 / period) ** (1 / 6)
        assert bandwidth_floor(counts, period) == pytest.approx(min(usual, 0.3 / period), rel=1e-15)
