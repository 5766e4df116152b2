"""The device's clock from arrivals, and ticks of two devices in one stream."""

from __future__ import annotations

import random

import pytest

from dcmp_hil.device.clock_ratio import ClockRatio
from dcmp_hil.device.node_uniqueness import TickWatch
from dcmp_hil.wire.messages import SampleReport, State

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


def sample(tick: int, counts: int = 0) -> SampleReport:
    return SampleReport(counts, 0, tick % 256, State.IDLE, missed=True, limited=False, fault_class=0)


def watch(*samples: SampleReport) -> TickWatch:
    found = TickWatch()
    for one in samples:
        found.add(one)
    return found


@pytest.mark.parametrize("apart", [-100, -2, -1, 0, 1, 2, 50, 127])
def test_two_devices_show_at_any_distance_of_their_ticks(apart: int) -> None:
    both = [one for k in range(20) for one in (sample(k), sample(k + apart, 5))]
    assert watch(*both).two_devices


@pytest.mark.parametrize(
    "samples",
    [
        [sample(k) for k in range(100)],
        [sample(k) for k in range(250, 350)],
        [one for k in range(50) for one in (sample(k), sample(k))],  # frames that come twice
        [sample(k) for k in range(0, 100, 5)],
        [sample(k) for k in (*range(50), *range(40))],  # a reset
        [sample(k ^ 1) if k % 16 < 2 else sample(k) for k in range(64)],  # now and then out of order
        [sample(0)],
    ],
)
def test_one_device_is_not_taken_for_two(samples: list[SampleReport]) -> None:
    assert not watch(*samples).two_devices
