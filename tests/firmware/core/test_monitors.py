"""The monitors in C give what their Python classes give: cause, cycle and the bits of every number."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.safety import monitors, outlier_filter
from dcmp_hil.safety.monitors import (
    DisturbanceWatch,
    FiniteMonitor,
    RangeMonitor,
    cycles_above,
    filter_keep,
)
from dcmp_hil.safety.outlier_filter import OutlierFilter
from dcmp_hil.values import Estimate, Sample
from tests.firmware.law import Law, context, same_bits

if TYPE_CHECKING:
    from tests.firmware.bench import Core
    from tests.firmware.law import Array

TIE_S = 2.0**-10  # a period of which every multiple is exact
STILL = Estimate(0.0, 0.0, 0.0)
NONE, SPEED, TRAVEL, WATCH_SPEED, DISTURBANCE, JUMP = 0.0, 3.0, 4.0, 5.0, 6.0, 7.0
ODD = [math.nan, math.inf, -math.inf, 1e308, -1e308, 0.0, -0.0, 5e-324]


def _drawn(draw: np.random.Generator, shape: tuple[int, ...], *also: float, share: float = 0.1) -> Array:
    """Return normal numbers of many sizes, some of them replaced by odd ones and by those of `also`."""
    numbers = draw.normal(size=shape) * 10.0 ** draw.uniform(-2.0, 2.0, shape)
    return np.where(draw.random(shape) < share, draw.choice([*ODD, *also], shape), numbers)


# ------------------------------------------------------------------------------------------- wrong positions


def _jumpy(seed: int, rows: int) -> Array:
    """Return ticks and positions in quarters: steps about the limits, gaps, no numbers."""
    draw = np.random.default_rng(seed)
    ticks = np.cumsum(draw.choice([1, 1, 1, 1, 2, 5], rows))
    still = np.repeat(draw.integers(0, 2, rows // 20), 20)  # quiet times, so that outliers are rare in some
    steps = np.where(still, 0.0, draw.choice([0.0, 0.25, 0.5, 0.75, 1.0, -1.25, 6.0], rows))
    position = np.cumsum(steps)
    odd = draw.random(rows)
    position = np.where(odd < 0.02, position + draw.choice([3.0, -50.0, 0.5], rows), position)
    position = np.where(odd > 0.99, draw.choice([math.nan, math.inf, -math.inf], rows), position)
    return np.column_stack([ticks, position])


def _filtered(limits: Array, rows: Array) -> Array:
    period, speed, floor, usual = limits.tolist()
    outliers, found = OutlierFilter(1.0, period, 0.0), []
    outliers.speed, outliers.floor, outliers.usual = speed, floor, usual
    for tick, position in rows.tolist():
        off = outliers.reject(Sample(tick * period, position, 0.0))
        stop: object = outliers.check(Sample(0.0, 0.0, 0.0), STILL)
        t, way = stop if isinstance(stop, tuple) else (0.0, 0.0)
        found.append((float(off), outliers.count, JUMP if stop else NONE, t / period, way))
    return np.array(found)


@pytest.mark.parametrize(
    ("speed", "floor", "usual"),
    [
        (512.0, 0.25, 0.5),  # as of a rig: usual is the larger of floor and speed times the period
        (512.0, 0.75, 0.75),
        (0.0, 0.25, 0.5),  # not of a rig: what is usual needs no further look
        (0.0, 0.75, 0.25),  # nor this: the floor is what counts
        (math.inf, 0.0, math.inf),
    ],
)
@pytest.mark.parametrize("kind", ["", "float_"])
def test_outliers_have_the_bits_of_python(
    core: Core, monkeypatch: pytest.MonkeyPatch, kind: str, speed: float, floor: float, usual: float
) -> None:
    """In single precision as well: quarters and powers of 2 are exact in both."""
    monkeypatch.setattr(outlier_filter, "jumped", lambda t, moved: (t, moved))
    limits = np.array([TIE_S, speed, floor, usual])
    ends = set()
    for seed in range(40):
        rows = _jumpy(seed, 200)
        wanted = _filtered(limits, rows)
        assert same_bits(Law(core, kind)("outliers", limits, rows, width=5), wanted)
        ends.add(wanted[-1, 2])
    assert (JUMP in ends) != math.isinf(speed)


@pytest.mark.parametrize("between", [96, 97, 98, 99, 100])
def test_the_third_jump_within_the_window_ends_the_run(
    core: Core, monkeypatch: pytest.MonkeyPatch, between: int
) -> None:
    monkeypatch.setattr(outlier_filter, "jumped", lambda t, moved: (t, moved))
    positions = [0.0, 2.0, *[0.0] * between, 3.0, 0.0, 4.0, 0.0]
    rows = np.column_stack([np.arange(len(positions)), positions])
    limits = np.array([TIE_S, 512.0, 0.25, 0.5])
    wanted = _filtered(limits, rows)
    assert wanted[-1, 2] == (JUMP if between <= 96 else NONE)
    assert same_bits(Law(core)("outliers", limits, rows, width=5), wanted)


# ---------------------------------------------------------------------------------------- numbers and ranges


def test_finite_numbers_are_those_of_python(core: Core) -> None:
    rows = _drawn(np.random.default_rng(5), (4000, 6))
    monitor = FiniteMonitor()
    wanted = [
        float(monitor.check(Sample(t, y, voltage), Estimate(*rest)) is None)
        for t, y, voltage, *rest in rows.tolist()
    ]
    assert 1000 < sum(wanted) < 3900
    assert same_bits(Law(core)("all_finite", rows), np.array(wanted))


@pytest.mark.parametrize("number", range(6))
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_each_number_has_to_be_finite(core: Core, number: int, bad: float) -> None:
    rows = np.zeros((2, 6))
    rows[1, number] = bad
    assert Law(core)("all_finite", rows).tolist() == [1.0, 0.0]


@pytest.mark.parametrize(("position", "velocity"), [(2.0, 10.0), (math.inf, 10.0), (2.0, math.inf)])
def test_ranges_are_those_of_python(core: Core, position: float, velocity: float) -> None:
    rows = _drawn(np.random.default_rng(6), (3000, 2), 2.0, -2.0, 10.0, -10.0)
    monitor, wanted = RangeMonitor(position, velocity), []
    for y, x2 in rows.tolist():
        stop = monitor.check(Sample(0.0, y, 0.0), Estimate(y, x2, 0.0))
        wanted.append(NONE if stop is None else {"speed": SPEED, "travel": TRAVEL}[stop.reason])
    assert {NONE, SPEED} <= set(wanted)
    assert same_bits(Law(core)("range", np.array([position, velocity]), rows), np.array(wanted))


# ------------------------------------------------------------------------------------- the watching observer


class _Told:
    """An observer whose estimates are given."""

    def __init__(self, rows: Array) -> None:
        self._rows = iter(rows.tolist())

    def update(self, sample: Sample) -> Estimate:
        """Return the next one."""
        del sample
        return Estimate(*next(self._rows))


@pytest.mark.parametrize("period", [1e-3, 1e-4, 0.02])
def test_the_watch_has_the_bits_of_python(core: Core, monkeypatch: pytest.MonkeyPatch, period: float) -> None:
    monkeypatch.setattr(monitors, "too_fast", lambda *_: (WATCH_SPEED, 0.0))
    monkeypatch.setattr(monitors, "unknown_forces", lambda _, filtered, *__: (DISTURBANCE, filtered))
    draw, limit, fastest = np.random.default_rng(7), 150.0, 30.0
    size = np.repeat(10.0 ** draw.uniform(0.0, 3.5, 400), 10)
    rows = draw.normal(size=(4000, 3)) * 12.0
    rows[:, 2] = size * np.sign(draw.normal(size=4000) + 2.0)
    rows[draw.integers(0, 4000, 20), 1] = draw.choice([math.nan, math.inf, -math.inf, 30.0, -30.0], 20)
    rows[-50, 2] = math.nan  # from here on there is none
    watch = DisturbanceWatch(
        _Told(rows), context(period=period), limit, ranges=RangeMonitor(math.inf, fastest)
    )
    stops: list[object] = [watch.check(Sample(k * period, 0.0, 0.0), STILL) for k in range(len(rows))]
    wanted = np.array([stop if isinstance(stop, tuple) else (NONE, 0.0) for stop in stops])
    setup = np.array([fastest, filter_keep(period), limit, cycles_above(period)])
    got = Law(core)("watch", setup, rows, width=3)
    got[got[:, 0] != DISTURBANCE, 1] = 0.0
    assert same_bits(got[:, :2], wanted)
    assert min(np.count_nonzero(wanted[:, 0] == cause) for cause in (NONE, WATCH_SPEED, DISTURBANCE)) > 10


def test_the_watch_at_its_limits(core: Core) -> None:
    """A disturbance of exactly the limit, a velocity of exactly the limit, and one cycle fewer."""
    rows = np.array(
        [[0.0, 8.0, 4.0], [0.0, -8.0, -4.0], *[[0.0, 0.0, 5.0]] * 3, [0.0, 0.0, 4.0], [0.0, 9.0, 5.0]]
    )
    got = Law(core)("watch", np.array([8.0, 0.0, 4.0, 3.0]), rows, width=3)
    assert got[:, 0].tolist() == [NONE] * 4 + [DISTURBANCE, NONE, WATCH_SPEED]
    assert got[:, 2].tolist() == [0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0]
    assert got[-1, 1] == 4.0  # the filter is not asked
