"""The limiter in C gives what its Python classes give: voltages, what is told, and why the run should end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from dcmp_hil.safety import chatter as chatter_module
from dcmp_hil.safety import limiter as limiter_module
from dcmp_hil.safety.chatter import Chatter
from dcmp_hil.safety.limiter import CONSECUTIVE_GAP_PERIODS_MAX, Limiter
from dcmp_hil.safety.reference_governor import ReferenceGovernor
from dcmp_hil.values import Reference, Sample
from tests.firmware.law import Law, same_bits

if TYPE_CHECKING:
    from tests.firmware.bench import Core
    from tests.firmware.law import Array

TIE_S = 2.0**-6  # a period of which every multiple is exact: half a second is 32
TRACKING, SATURATION, CHATTER = 15.0, 16.0, 17.0
KINDS = {"reference": 1, "velocity": 2, "acceleration": 3, "way": 4, "voltage": 5, "slew": 6}
NOTHING = (0.0, 0.0, 0.0)
ODD = [math.nan, math.inf, -math.inf, 0.0, -0.0, 5.0, -5.0]
ROWS = 600


@pytest.fixture(autouse=True)
def numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let sentences be their numbers."""
    monkeypatch.setattr(limiter_module, "limit_event", lambda _, limit, *values: (limit, *values))
    monkeypatch.setattr(limiter_module, "astray", lambda t, x, y, _: (TRACKING, t, x, y))
    monkeypatch.setattr(limiter_module, "saturated", lambda t, demand, _: (SATURATION, t, demand, 0.0))
    monkeypatch.setattr(chatter_module, "chattering", lambda t, mean, *_: (CHATTER, t, mean, 0.0))


# ------------------------------------------------------------------------------------------- clamp and slew


@pytest.mark.parametrize("most", [5.0, 0.0, math.inf])
def test_clamp_and_slew_have_the_bits_of_python(core: Core, most: float) -> None:
    draw = np.random.default_rng(1)
    x = np.append(draw.normal(size=500) * 5.0, ODD)
    wanted = np.array([max(-most, min(most, each)) for each in x.tolist()])
    assert same_bits(Law(core)("limited", most, x), wanted)
    rows = np.column_stack([draw.choice(x, 2000), draw.choice(x, 2000)])
    limiter = Limiter(voltage=5.0, period=TIE_S, slew=most, notify=lambda _: None)
    slewed = np.array([limiter.limit_slew(*row) for row in rows.tolist()])
    assert same_bits(Law(core)("slewed", most * TIE_S, rows), slewed)


# ------------------------------------------------------------------------------------------------- chatter


def _judged(period: float, rows: Array) -> Array:
    judge, found = Chatter(200.0, period, 0.0), []
    for tick, change in rows.tolist():
        found.append(judge.judge(tick * period, change) is not None)
    return np.array(found)


def _changes(seed: int) -> Array:
    """Return ends of blocks with the sum of |dV|: steady, in bursts, at times that stand still."""
    draw = np.random.default_rng(seed)
    ticks = np.cumsum(draw.choice([50, 50, 50, 51, 60, 0], 120, p=[0.3, 0.3, 0.3, 0.04, 0.04, 0.02]))
    level = np.repeat(draw.choice([20.0, 90.0, 101.0, 110.0, 300.0], 24), 5)
    share = draw.choice([1.0, 1.0, 0.0, 0.4, 1.3], 120) if seed % 2 else 1.0
    return np.column_stack([ticks, level * share * draw.uniform(0.9, 1.1, 120)])


def test_chatter_has_the_bits_of_python(core: Core) -> None:
    ends = 0
    for seed in range(60):
        rows, period = _changes(seed), 1e-3
        got = Law(core)("chatter", np.array([period, 2000.0]), rows, width=2)
        wanted = _judged(period, rows)
        assert np.array_equal(got[:, 0] > 0.0, wanted)
        ends += bool(wanted.any())
    assert 15 < ends < 55


def test_the_mean_is_a_sum_of_the_newest_ten_in_their_order(core: Core) -> None:
    draw, period, rates = np.random.default_rng(2), 1e-3, []
    rows = np.column_stack([50.0 * np.arange(1.0, 41.0), 10.0 ** draw.uniform(-3.0, 3.0, 40)])
    got = Law(core)("chatter", np.array([period, math.inf]), rows, width=2)[:, 1]
    instants = (rows[:, 0] * period).tolist()
    for k in range(1, 40):
        rates.append(rows[k, 1] / (instants[k] - instants[k - 1]))
        total = 0.0
        for rate in rates[-10:]:
            total = total + rate
        assert got[k] == total / 10.0
    assert got[0] == 0.0


def _blocks(rates: list[float]) -> Array:
    """Return blocks a second long, so that a change in V is a rate in V/s; the first has none."""
    return np.array([[64.0 * k, rate] for k, rate in enumerate([0.0, *rates])])


BORDERS = {
    "at the limit for half a second": ([2000.0] * 11, True),
    "one block fewer": ([2000.0] * 10, False),
    "a mean just below": ([2000.0] * 10 + [1999.0], False),
    "a pause of two blocks": ([9000.0, 900.0, 900.0, *[9000.0] * 8], False),
    "two blocks of half the limit each are none": ([9000.0, 1000.0, 1000.0, *[9000.0] * 8], True),
    "the first of those that are kept": ([900.0, 900.0, *[9000.0] * 9], False),
    "the last two": ([*[9000.0] * 9, 900.0, 900.0], False),
    "a last pause of exactly the limit is none": ([*[9000.0] * 9, 1000.0, 1000.0], True),
    "bursts": ([*[9000.0] * 9, 0.0, 0.0] * 3 + [9000.0] * 6, True),
    "pauses as long as two bursts": (([9000.0] * 4 + [0.0] * 12) * 8, False),
}


@pytest.mark.parametrize("name", BORDERS)
def test_chatter_at_its_borders(core: Core, name: str) -> None:
    rates, ends = BORDERS[name]
    rows = _blocks(rates)
    wanted = _judged(TIE_S, rows)
    assert wanted.any() == ends
    assert np.array_equal(Law(core)("chatter", np.array([TIE_S, 2000.0]), rows, width=2)[:, 0] > 0.0, wanted)


# ------------------------------------------------------------------------------------------------ the limiter


class Limits(NamedTuple):
    """Limits of a rig."""

    voltage: float = 5.0
    slew: float = math.inf
    position: float = math.inf
    velocity: float = math.inf
    acceleration: float = math.inf
    error: float = math.inf
    chatter: float | None = None  # V/s, expected
    block: int = 3  # cycles


RIGS = {
    "none": Limits(voltage=math.inf),
    "voltage": Limits(),
    "slew": Limits(slew=96.0),
    "reference": Limits(position=2.0, velocity=8.0, acceleration=300.0),
    "tracking": Limits(position=2.0, velocity=8.0, error=0.5),
    "chatter": Limits(voltage=100.0, chatter=10.0),
    "chatter, every cycle a block": Limits(voltage=100.0, chatter=10.0, block=1),
    "astray": Limits(error=0.5),
    "all": Limits(5.0, 160.0, 2.0, 8.0, 300.0, 0.5, 20.0),
}
EXACT = ("none", "voltage", "slew", "astray")
"""Those whose numbers are exact in single precision, so that its bits are the same."""


def _steps(seed: int) -> Array:
    """Return rows of tick, position, reference, demand and authority, in stretches of different kinds."""
    draw = np.random.default_rng(seed)
    ticks = np.cumsum(draw.choice([1, 1, 1, 1, 1, 1, 1, 2, 3], ROWS)) + draw.integers(0, 1000)
    stretch = np.concatenate([np.full(n, k) for k, n in enumerate(draw.integers(1, 60, 60))])[:ROWS]

    def of_stretch(*choices: float) -> Array:
        return np.asarray(draw.choice(choices, 60)[stretch], float)

    t = ticks * TIE_S
    x = of_stretch(1.0, 1.0, 2.2, 0.2) * np.sin(t)
    v = of_stretch(1.0, 1.0, 1.0, 9.0) * np.cos(t)
    a = of_stretch(1.0, 1.0, 1.0, 400.0) * -np.sin(t)
    position = x + of_stretch(0.0, 0.1, 0.1, 0.5, 0.6, -2.0)
    demand = of_stretch(0.0, 3.0, 6.0, -9.0) + of_stretch(0.1, 0.1, 20.0) * draw.normal(size=ROWS)
    odd = draw.random((3, ROWS))
    x = np.where(odd[0] < 0.004, draw.choice(ODD, ROWS), x)
    position = np.where(odd[1] < 0.004, draw.choice(ODD, ROWS), position)
    demand = np.where(odd[2] < 0.01, draw.choice(ODD, ROWS), demand)
    numbers = (
        np.round(np.column_stack([position, x, v, a, demand]) * 64.0) / 64.0
    )  # exact in single precision
    return np.column_stack([ticks, numbers, of_stretch(1.0, 1.0, 1.0, 0.0)])


def _limiter(limits: Limits, told: list[tuple[float, ...]]) -> Limiter:
    *bounds, expected, block = limits
    names = ("voltage", "slew", "position", "velocity", "acceleration", "error")
    limiter = Limiter(period=TIE_S, notify=told.append, **dict(zip(names, bounds, strict=True)))  # type: ignore[arg-type]
    if expected is not None:
        judge = Chatter(expected, TIE_S, 0.0)
        judge.block = block
        limiter.watch_variation(judge)
    return limiter


def _put(told: list[tuple[float, ...]]) -> list[float]:
    """Return what is told of reference, voltage and slew, three numbers each."""
    by_kind = {KINDS[str(name)]: [float(each) for each in values] for name, *values in told}
    places = [range(1, 5), range(5, 6), range(6, 7)]
    found: list[float] = []
    for place in places:
        kinds = [kind for kind in place if kind in by_kind]
        found += [float(kinds[0]), *by_kind[kinds[0]], 0.0][:3] if kinds else NOTHING
    return found


def _in_python(limits: Limits, rows: Array) -> tuple[Array, Array]:
    """Return the columns for C, with the governed reference, and what the limiter gives."""
    told: list[tuple[float, ...]] = []
    limiter, last = _limiter(limits, told), 0.0
    governor = ReferenceGovernor(limiter.bounds) if math.isfinite(limits.position + limits.velocity) else None
    given, found = [], []
    for tick, position, x, v, a, demand, authority in rows.tolist():
        t, asked = tick * TIE_S, Reference(x, v, a)
        governed = governor.bound(t, asked) if governor else asked
        given.append((tick, position, *asked, *governed, governed is not asked, demand, authority))
        told.clear()
        limiter.limit_reference(Sample(t, position, 0.0), asked)
        last = limiter.limit_voltage(t, demand, last) if authority else demand
        cause: object = limiter.objection
        code, at, *values = cause if isinstance(cause, tuple) else (0.0, 0.0, 0.0, 0.0)
        found.append((last, *_put(told), limiter.clamped, code, at / TIE_S, *values))
    return np.array(given, float), np.array(found, float)


def _setup(limits: Limits) -> Array:
    limiter = _limiter(limits, [])
    judges = limits.chatter is not None
    allowed, block = chatter_module.limit_V_s(limits.chatter or 0.0), limits.block if judges else 0
    bounds = limiter.bounds
    return np.array(
        [
            *(TIE_S, CONSECUTIVE_GAP_PERIODS_MAX * TIE_S, limits.voltage, limits.slew * TIE_S),
            *(bounds.position, bounds.velocity, bounds.acceleration, limits.error, allowed, block),
            float(limits.slew < math.inf),
        ]
    )


@pytest.mark.parametrize(
    ("name", "kind"), [*((name, "") for name in RIGS), *((name, "float_") for name in EXACT)]
)
def test_the_limiter_has_the_bits_of_python(core: Core, name: str, kind: str) -> None:
    limits, law = RIGS[name], Law(core, kind)
    told, causes = set(), set()
    for seed in range(8):
        given, wanted = _in_python(limits, _steps(seed))
        got = law("limiter", _setup(limits), given, width=16)
        assert same_bits(got[:, :15], wanted)
        assert got[:, 15].min() >= 0.0  # a count that is not used does not go down for ever
        told |= set(wanted[:, [1, 4, 7]].ravel().tolist())
        causes |= set(wanted[:, 11].tolist())
    if name == "all":
        assert told == set(range(7))
        assert causes >= {0.0, TRACKING, SATURATION}
    if limits.chatter == 10.0:
        assert CHATTER in causes


def _same(core: Core, limits: Limits, rows: list[list[float]]) -> Array:
    """Return what both say of a few rows."""
    given, wanted = _in_python(limits, np.array(rows))
    assert same_bits(Law(core)("limiter", _setup(limits), given, width=16)[:, :15], wanted)
    return wanted


def test_what_is_told_is_of_this_cycle(core: Core) -> None:
    """The governor leads, and then is asked for no number, which it lets through."""
    asked = [[k, 0.0, x, 0.0, 0.0, 0.0, 1.0] for k, x in enumerate([0.0, 2.5, math.nan])]
    assert _same(core, RIGS["reference"], asked)[:, 1].tolist() == [0.0, 1.0, 0.0]


def test_no_limit_of_the_slew_after_an_infinite_voltage(core: Core) -> None:
    rows = [[k, 0.0, 0.0, 0.0, 0.0, demand, 1.0] for k, demand in enumerate([math.inf, math.nan, 1.0])]
    assert _same(core, RIGS["none"], rows)[:, 0].tolist() == [math.inf, math.inf, 1.0]


def test_a_demand_of_exactly_the_limit_stays_as_it_is(core: Core) -> None:
    """With its sign, where the limit is 0."""
    rows = [[k, 0.0, 0.0, 0.0, 0.0, demand, 1.0] for k, demand in enumerate([0.0, -0.0, 1.0, 0.0])]
    assert not np.signbit(_same(core, Limits(voltage=0.0), rows)[0, 0])
