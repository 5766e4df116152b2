"""The device's clock from arrivals."""

from __future__ import annotations

import random

import pytest

from dcmp_hil.device.clock_ratio import ClockRatio

PERIOD_NS = 1e6  # ns


def arrivals(error: float, ticks: int, seed: int = 1) -> ClockRatio:
    """Let samples arrive late by chance, in fours, and with stops of the computer, on a clock that is off."""
    ratio, rng = ClockRatio(PERIOD_NS), random.Random(seed)
    late, heard = 0.0, 0
    for tick in range(5000, 5000 + ticks):
        late = 50 * PERIOD_NS if rng.random() < 0.002 else max(0.0, late - PERIOD_NS)
        batch = 4 * ((tick + 3) // 4)  # an adapter that hands four over at once
        at = int(batch * PERIOD_NS / (1.0 + error) + late + rng.expovariate(1e-5))
        heard = max(heard, at)
        ratio.add(tick, heard)
    return ratio


@pytest.mark.parametrize("error", [0.1, 0.02, 0.006, 0.0, -0.006, -0.02, -0.1, -0.5, 1.0])
@pytest.mark.parametrize("seed", range(5))
def test_clock_is_found_in_spite_of_lateness(error: float, seed: int) -> None:
    found = arrivals(error, 4000, seed).error
    assert found == pytest.approx(error, abs=0.002 * (1 + abs(error)))


@pytest.mark.parametrize("right", [2000, 300_000])
@pytest.mark.parametrize("error", [0.02, -0.02, 0.008])
def test_clock_that_goes_wrong_later_is_found_within_2200_ticks(right: int, error: float) -> None:
    ratio = ClockRatio(PERIOD_NS)
    for tick in range(0, right, 1 if right < 10_000 else 16):
        ratio.add(tick, round(tick * PERIOD_NS))
    for tick in range(2200):
        ratio.add(right + tick, round((right + tick / (1.0 + error)) * PERIOD_NS))
    assert ratio.error == pytest.approx(error, rel=0.01)


def test_clock_is_not_known_at_once() -> None:
    assert arrivals(0.1, 600).error is None
