"""The elementary functions in C: the bits of dcmp_hil.control.elementary."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.control import elementary
from tests.firmware.law import Array, Law, same_bits

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.firmware.bench import Core

MANY = 4000
TINY = float(np.finfo(float).tiny)
WHOLES = [0.5, 1.0, 1.5, 2.0, 2.5, 2.0**51, 2.0**51 - 0.5, 2.0**51 + 1.0, 2.0**52, 2.0**53, 1e300]
EVERY = [0.0, 5e-324, 1e-310, TINY, 1e-200, 1e-17, 1.7976931348623157e308, math.inf, math.nan, *WHOLES]
POSITIVE = [TINY, 1.7976931348623157e308, 1.0, 2.0, 4.0, 8.0, 0.5, 0.25, 0.125, math.sqrt(0.5), *WHOLES]


def _either_way(*sizes: float, edges: tuple[float, ...] = ()) -> Array:
    """Return arguments of both signs: even within each size, what is next to the edges, and special ones."""
    draw = np.random.default_rng(7)
    near = [math.nextafter(edge, to) for edge in edges for to in (0.0, edge, math.inf)]
    x = np.concatenate([*(draw.uniform(0.0, size, MANY // len(sizes)) for size in sizes), near, EVERY])
    return np.concatenate([x, -x])


def _positive() -> Array:
    return np.concatenate([10.0 ** np.random.default_rng(8).uniform(-307.0, 308.0, MANY), POSITIVE])


def _floor(x: float) -> float:
    return float(math.floor(x)) if abs(x) < 2.0**51 else x


def _square_root(x: float) -> float:
    return math.sqrt(x) if x >= 0.0 else math.nan


SINES = _either_way(1.0, 20.0, 1e6, 2.0**30, 2.0**33, edges=(math.pi, 2.0**30))
EXPONENTS = _either_way(1e-8, 0.7, 50.0, 800.0, edges=(700.0, math.log(2.0), 0.5 * math.log(2.0)))
ROUNDED = _either_way(3.0, 1e6, 2.0**53, edges=tuple(WHOLES))
CASES: list[tuple[str, Callable[[float], float], Array]] = [
    ("magnitude", abs, np.abs(ROUNDED)),
    ("is_finite", math.isfinite, ROUNDED),
    ("square_root", _square_root, ROUNDED),
    ("sine", elementary.sine, SINES),
    ("cosine", elementary.cosine, SINES),
    ("expm1", elementary.expm1, EXPONENTS),
    ("exponential", elementary.exponential, EXPONENTS),
    ("logarithm", elementary.logarithm, _positive()),
    ("inverse_cube_root", elementary.inverse_cube_root, np.append(_positive(), math.nan)),
]
WANTED = {name: np.array([float(function(x)) for x in given.tolist()]) for name, function, given in CASES}


@pytest.mark.parametrize(("name", "given"), [(name, given) for name, _, given in CASES])
def test_same_bits_as_python(core: Core, name: str, given: Array) -> None:
    assert same_bits(Law(core)(name, given), WANTED[name])


def test_magnitude_and_floor_are_the_exact_ones(core: Core) -> None:
    law = Law(core)
    assert np.array_equal(law("magnitude", ROUNDED), np.abs(ROUNDED), equal_nan=True)
    assert np.array_equal(law("floor", ROUNDED), np.array([_floor(x) for x in ROUNDED]), equal_nan=True)
    whole = ROUNDED[np.abs(ROUNDED) < 2.0**51]
    assert np.array_equal(law("nearest", whole), np.round(whole))


def test_of_0_a_negative_argument_and_no_number(core: Core) -> None:
    law = Law(core)
    assert same_bits(law("inverse_cube_root", np.array([0.0, -1.0])), np.array([0.0, -1.0]))
    assert np.isnan(law("sine", np.array([math.nan, math.inf, -math.inf]))).all()
    assert np.isnan(law("expm1", np.array([math.nan]))).all()


EPSILON = 2.0**-23
SINGLE: dict[
    str, tuple[Callable[[Array], Array], Array, float, float]
] = {  # largest error: relative, absolute
    "sine": (np.sin, np.linspace(-3200.0, 3200.0, 20001), 0.0, 1.3e-7),
    "sine, far": (np.sin, np.linspace(6e4, 65535.0, 5001), 0.0, 2.0**-9),
    "cosine": (np.cos, np.linspace(-3.0, 3.0, 5001), 0.0, 4e-7),  # the quarter of a turn is added in float
    "expm1": (np.expm1, np.linspace(-87.0, 87.0, 20001), 2 * EPSILON, 0.0),
    "expm1, small": (np.expm1, 10.0 ** np.linspace(-30.0, 0.0, 5001), 2 * EPSILON, 0.0),
    "exponential": (np.exp, np.linspace(-87.0, 87.0, 20001), 2 * EPSILON, 0.0),
    "logarithm": (np.log, 10.0 ** np.linspace(-37.0, 38.0, 20001), 2 * EPSILON, EPSILON / 8),
    "inverse_cube_root": (lambda x: x ** (-1 / 3), 10.0 ** np.linspace(-37.0, 38.0, 20001), 3 * EPSILON, 0.0),
    "square_root": (np.sqrt, 10.0 ** np.linspace(-37.0, 38.0, 5001), EPSILON / 2, 0.0),
    "nearest": (np.round, np.linspace(-99.0, 99.0, 1981), 0.0, 0.0),
    "floor": (
        np.floor,
        np.append(np.linspace(-99.0, 99.0, 1981), [2.0**22 - 0.5, 2.0**22 + 1.0, 1e30]),
        0.0,
        0.0,
    ),
}


@pytest.mark.parametrize("name", SINGLE)
def test_single_precision_is_as_good_as_its_bits(core: Core, name: str) -> None:
    function, given, relative, absolute = SINGLE[name]
    x = given.astype(np.float32).astype(float)
    wanted = function(x)
    apart = np.abs(Law(core, "float_")(name.partition(",")[0], x) - wanted) - relative * np.abs(wanted)
    assert apart.max() <= absolute


def test_single_precision_at_its_limits(core: Core) -> None:
    law = Law(core, "float_")
    assert law("sine", np.array([65536.0, -65536.0, 1e30])).tolist() == [0.0, 0.0, 0.0]
    assert law("sine", np.array([65535.0]))[0] != 0.0
    ends = law("exponential", np.array([87.0, 87.01, 1e30, -87.0, -87.01, -1e30, math.nan]))
    assert ends[0] == ends[1] == ends[2]
    assert ends[3] == ends[4] == ends[5] > 0.0
    assert math.isnan(ends[6])
