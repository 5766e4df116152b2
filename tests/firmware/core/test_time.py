"""Time in ticks: the bits of t = tick * period in double, and no loss after days in single precision."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.common.rate_limit import RateLimit
from dcmp_hil.safety.limiter import _Lasting
from tests.firmware.law import Law, same_bits

if TYPE_CHECKING:
    from tests.firmware.bench import Core
    from tests.firmware.law import Array

PERIODS_S = [1e-3, 1e-4, 3e-4, 2.0**-10]
TIE_S = 2.0**-6  # a period of which every multiple is exact


def _ticks(seed: int, longest: int) -> Array:
    """Return ticks with gaps, from 2 on: most are one apart, some several, few far more."""
    draw = np.random.default_rng(seed)
    steps = draw.choice([1, 2, 3], 4000, p=[0.85, 0.14, 0.01])
    steps[:60] = 1
    far = draw.random(4000) < 0.005
    far[:60] = False
    return np.cumsum(np.where(far, draw.integers(1, longest, 4000), steps)) + 1.0


@pytest.mark.parametrize("period", PERIODS_S)
def test_instants_and_differences_have_the_bits_of_a_host(core: Core, period: float) -> None:
    ticks = np.random.default_rng(1).integers(0, 2**40, (2000, 2)).astype(float)
    instants = ticks * period
    law = Law(core)
    assert same_bits(law("instant", period, ticks[:, 0]), instants[:, 0])
    assert same_bits(law("elapsed", period, ticks), instants[:, 1] - instants[:, 0])


def test_single_precision_loses_nothing_after_days(core: Core) -> None:
    draw, period = np.random.default_rng(2), np.float32(1e-3)
    began, steps = draw.integers(0, 2**40, 2000), draw.integers(-1000, 1000, 2000)
    wanted = steps.astype(np.float32) * period
    rows = np.column_stack([began, began + steps])
    assert np.array_equal(Law(core, "float_")("elapsed", float(period), rows), wanted.astype(float))
    ticks = np.array([0.0, 1.0, 1000.0, 2.0**33 + 512.0])
    instants = ticks.astype(np.float32) * period
    assert np.array_equal(Law(core, "float_")("instant", float(period), ticks), instants.astype(float))


@pytest.mark.parametrize(
    ("kind", "period", "gap_periods", "allowed"),
    [("", TIE_S, 2.0, 0.5), ("float_", TIE_S, 2.0, 0.5), ("", 1e-3, 2.5, 0.05), ("", TIE_S, 2.5, 0.0)],
)
def test_a_condition_lasts_as_in_python(
    core: Core, kind: str, period: float, gap_periods: float, allowed: float
) -> None:
    ticks, lasting = _ticks(3, 40), _Lasting(allowed, gap_periods * period)
    wanted = np.array([float(lasting.too_long(tick * period)) for tick in ticks.tolist()])
    assert wanted.sum() > 100
    setup = np.array([period, gap_periods * period, allowed])
    assert same_bits(Law(core, kind)("lasting", setup, ticks), wanted)


@pytest.mark.parametrize(("period", "pause"), [(TIE_S, 1.0), (1e-3, 0.037)])
def test_messages_pause_as_in_python(core: Core, period: float, pause: float) -> None:
    ticks, limit = _ticks(4, 200), RateLimit(pause)
    wanted = np.array([float(limit.passes("x", tick * period)) for tick in ticks.tolist()])
    assert same_bits(Law(core)("telling", np.array([period, pause]), ticks), wanted)
