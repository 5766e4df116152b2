"""The reference governor in C: the bits of the Python class."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.safety.reference_governor import Bounds, ReferenceGovernor
from dcmp_hil.values import Reference
from tests.firmware.law import Array, Law, same_bits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.firmware.bench import Core

T = 1e-3
WIDE = Bounds(100.0, 100.0, 100.0, 100.0)
NONE = Reference(math.nan, 0.0, 0.0)
BOUNDS = {
    "nominal": Bounds(5.969, 19.0, 44.8, 27.0, 54.0),
    "no limit of the motor": Bounds(5.969, 19.0, 44.8, 27.0),
    "unknown motor": Bounds(5.969, 19.0, 44.8, 27.0, math.nan),
    "strong motor": Bounds(5.969, 19.0, 44.8, 27.0, 180.0),
    "slow": Bounds(3.0, 0.5, 10.0, 10.0, 54.0),
    "narrow": Bounds(0.25, 19.0, 44.8, 1.0, 54.0),
    "far and slow to stop": Bounds(50.0, 8.0, 1000.0, 0.5, 54.0),
    "still": Bounds(0.0, 0.0, 0.0, 1.0, 54.0),
}
Row = tuple[float, Reference]


def _setup(bounds: Bounds) -> Array:
    position, velocity, acceleration, braking, strongest = bounds
    return np.array([position, velocity, acceleration, braking, bounds.stop, strongest])


def _asked(bounds: Bounds, seed: int, periods: int = 800) -> list[Row]:
    """Return references with jumps, rests, sines beyond the bounds, lost ticks, and what is no number."""
    rng = np.random.default_rng(seed)
    rows, tick = list[Row](), int(rng.integers(0, 1000))
    kind, offset, amplitude, rate = 0, 0.0, 1.0, 1.0
    odd = (math.nan, math.inf, -math.inf, 1e308, -1e308, *bounds)
    for k in range(periods):
        if k % 97 == 0 or rng.random() < 0.004:
            kind, offset = int(rng.integers(0, 4)), float(rng.uniform(-1.2, 1.2)) * bounds.position
            amplitude, rate = (
                float(rng.choice([0.01, 0.3, 2.0])) * bounds.position,
                float(rng.uniform(0.1, 9.0)),
            )
        s, c = math.sin(rate * tick * T), math.cos(rate * tick * T)
        asked = Reference(offset + amplitude * s, amplitude * rate * c, -amplitude * rate * rate * s)
        if kind == 1:
            asked = Reference(offset, 0.0, 0.0)
        elif kind == 2:
            asked = Reference(0.3 * offset + float(rng.choice([0.0, 0.1, 0.5, 1.9])), 0.0, 0.0)
        if rng.random() < 0.01:
            spoilt = list(asked)
            spoilt[int(rng.integers(0, 3))] = float(rng.choice(odd))
            asked = Reference(*spoilt)
        rows.append((float(tick), asked))
        tick += int(rng.choice([1, 1, 1, 1, 1, 1, 2, 7, 0, 130, -1], p=[0.15] * 6 + [0.02] * 5))
    return rows


def _in_python(bounds: Bounds, rows: Sequence[Row], period: float) -> Array:
    governor, found = ReferenceGovernor(bounds), []
    for tick, asked in rows:
        reference = governor.bound(tick * period, asked)
        found.append((*reference, reference is not asked, governor.leads))
    return np.array(found, float)


@pytest.mark.parametrize("name", BOUNDS)
@pytest.mark.parametrize("seed", range(3))
def test_governor_has_the_bits_of_python(core: Core, name: str, seed: int) -> None:
    bounds = BOUNDS[name]
    rows = _asked(bounds, seed)
    period = (T, 1e-4, 0.01)[seed]
    wanted = _in_python(bounds, rows, period)
    table = np.array([(tick, *asked) for tick, asked in rows])
    got = Law(core)("governor", _setup(bounds), period, table, width=5)
    assert same_bits(got, wanted)
    assert 0.02 < wanted[:, 3].mean() < 0.999


def _led(core: Core, bounds: Bounds, rows: Sequence[tuple[int, Reference, Reference]]) -> tuple[Array, Array]:
    """Return how a governor that leads moves on, in C and in Python: by ticks, from its last reference."""
    wanted = []
    for ticks, own, asked in rows:
        governor = ReferenceGovernor(bounds)
        governor.last, governor.leads = own, True
        governor.bound(0.0, NONE)
        reference = governor.bound(ticks * T, asked)
        wanted.append((*reference, reference is not asked, governor.leads))
    table = np.array([(ticks, *own, *asked) for ticks, own, asked in rows])
    return Law(core)("led", _setup(bounds), T, table, width=5), np.array(wanted, float)


@pytest.mark.parametrize("name", [name for name in BOUNDS if name != "still"])
def test_own_motion_has_the_bits_of_python_from_anywhere(core: Core, name: str) -> None:
    bounds, rng = BOUNDS[name], np.random.default_rng(7)
    most = np.array(bounds[:3])
    rows = []
    for _ in range(600):
        own = rng.choice([0.0, -1.0, 1.0, rng.uniform(-1, 1), rng.uniform(-0.01, 0.01)], 3) * most
        asked = rng.choice([0.0, -1.0, 1.0, 1.1, rng.uniform(-1, 1)], 3) * most
        near = own + rng.uniform(-1.5, 1.5, 3) * (5e-4, 0.02, 2.0)
        rows.append(
            (int(rng.choice([0, 1, 2, 3, 5, 10, 99, 100, 101, 1000])), Reference(*own.tolist()), asked)
        )
        rows[-1] = (*rows[-1][:2], Reference(*(near if rng.random() < 0.3 else asked).tolist()))
    got, wanted = _led(core, bounds, rows)
    assert same_bits(got, wanted)
    assert 0.0 < wanted[:, 4].mean() < 1.0


def test_own_motion_at_the_ties(core: Core) -> None:
    """Numbers that are exact in binary: a bound, a tolerance or a way is met to the last bit."""
    bounds = Bounds(4.0, 2.0, 8.0, 0.5 / 0.7, 54.0)
    stop = bounds.stop
    zero = Reference(0.0, 0.0, 0.0)
    met = [
        Reference(5e-4, 0.0, 0.0),
        Reference(0.0, 0.02, 0.0),
        Reference(0.0, 0.0, 2.0),
        Reference(-5e-4, -0.02, -2.0),
    ]
    met += [Reference(*(1.0005 * part for part in each)) for each in met]  # not met
    met += [Reference(1e308, 1e308, 0.0), Reference(1e308, 0.0, 1e308)]  # their sums are infinite
    rows = [(1, zero, each) for each in met]
    rows += [(1, each, zero) for each in met]
    edge = 4.0 - stop  # from here a stop from 1 rad/s ends at the bound
    for x, v in ((edge, 1.0), (-edge, -1.0), (4.0, 0.0), (-4.0, 0.0), (0.0, 2.0), (0.0, -2.0)):
        own = Reference(x, v, 0.0)
        rows += [(ticks, own, asked) for asked in (own, zero, Reference(-x, 0.0, 0.0)) for ticks in (0, 1)]
    got, wanted = _led(core, bounds, rows)
    assert same_bits(got, wanted)


def test_own_motion_from_where_its_way_begins_to_bend(core: Core) -> None:
    for braking in (0.37, 0.74, 1.48):  # the two formulas of the way differ there in the last bit
        near = 0.5 * braking / 25.0
        rows = [
            (1, Reference(0.0, sign * 4.5 * near, 0.0), Reference(sign * near, 0.0, 0.0))
            for sign in (1.0, -1.0)
        ]
        got, wanted = _led(core, Bounds(4.0, 2.0, 8.0, braking, 54.0), rows)
        assert same_bits(got, wanted)


JUMPS: dict[str, tuple[Bounds, float, list[tuple[int, float]]]] = {
    "size": (WIDE, 0.0, [(1, 2.0)]),
    "too long": (WIDE, 1.0, [(1, 2.0 + 2.0**-40)]),
    "speed": (Bounds(100.0, 3.0, 100.0, 100.0, 6.0), 0.0, [(1, 1.0)]),
    "too fast": (Bounds(100.0, 3.0, 100.0, 100.0, 6.0), 1.0, [(1, 1.0 + 2.0**-40)]),
    "unknown speed": (Bounds(100.0, 0.5, 100.0, 100.0), 0.0, [(1, 1.0)]),
    "way": (Bounds(1.4, 100.0, 100.0, 100.0), 0.0, [(1, 1.0)]),
    "too far": (Bounds(1.4, 100.0, 100.0, 100.0), 1.0, [(1, 1.0 + 2.0**-40)]),
    "pause": (WIDE, 0.0, [(1, 1.0), (513, 0.0)]),
    "too early": (WIDE, 1.0, [(1, 1.0), (512, 0.0)]),
    "no jump": (WIDE, 0.0, [(1, 1.0), (2, 1.0 + 100.0 * 2.0**-10)]),
}
"""Bounds, whether the last jump is led, and jumps: tick and position."""


@pytest.mark.parametrize("name", JUMPS)
def test_jump_at_a_tie_is_left_to_the_controller(core: Core, name: str) -> None:
    bounds, led, jumps = JUMPS[name]
    asked, x = [(0.0, Reference(0.0, 0.0, 0.0))], 0.0
    for tick, target in jumps:
        asked += [(tick - 1.0, Reference(x, 0.0, 0.0)), (float(tick), Reference(target, 0.0, 0.0))]
        x = target
    wanted = _in_python(bounds, asked, 2.0**-10)
    table = np.array([(tick, *each) for tick, each in asked])
    assert same_bits(Law(core)("governor", _setup(bounds), 2.0**-10, table, width=5), wanted)
    assert wanted[-1, 3] == led
    assert not wanted[:-1, 3].any()


def test_first_reference_beyond_the_bounds_begins_at_the_bound(core: Core) -> None:
    bounds = BOUNDS["nominal"]
    for x, v in ((7.0, 90.0), (-7.0, 90.0), (3.0, 90.0), (5.9, 5.0)):
        rows = [(5.0, NONE), (5.0, Reference(x, v, 0.0)), (6.0, Reference(x, 0.0, 0.0))]
        rows += [
            (7.0, Reference(math.copysign(min(5.969, abs(x)), x), 0.0, 0.0)),
            (8.0, Reference(0.0, 0.0, 0.0)),
        ]
        for asked in (rows, rows[1:]):
            table = np.array([(tick, *each) for tick, each in asked])
            got = Law(core)("governor", _setup(bounds), T, table, width=5)
            assert same_bits(got, _in_python(bounds, asked, T))


def test_single_precision_stays_inside_the_bounds(core: Core) -> None:
    bounds = BOUNDS["nominal"]
    s = np.arange(4000.0)
    table = np.column_stack([s, 8.0 * np.sin(4e-3 * s), 32.0 * np.cos(4e-3 * s), -128.0 * np.sin(4e-3 * s)])
    single, double = (
        Law(core, kind)("governor", _setup(bounds), T, table, width=5) for kind in ("float_", "")
    )
    assert np.abs(single[:, 0]).max() <= bounds.position + 1e-6
    assert np.abs(single - double)[:, 0].max() < 1e-3
