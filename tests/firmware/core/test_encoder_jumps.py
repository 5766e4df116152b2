"""Jumps of the encoder, and one wrong count, of any size and at any rate."""

import os

import pytest

from tests.firmware.bench import Bench, Core
from tests.firmware.core_library import PREBUILT
from tests.firmware.encoder_bench import ENCODER_JUMP, OVER_SPEED, OVER_TRAVEL, RUN, tick_in_run


@pytest.mark.parametrize("jump", [161, -161, 5000, -100000, 1 << 22])
def test_one_jump_or_two_are_borne_three_are_not(core: Core, jump: int) -> None:
    """Four times 40,000 counts/s are 160 counts in a period."""
    bench = Bench(core)
    bench.arm()
    assert tick_in_run(bench, jump) == 0
    assert tick_in_run(bench, 3) == 0
    assert tick_in_run(bench, -jump) == 0
    assert tick_in_run(bench) == 0
    assert bench.device.encoder.position == 3
    assert tick_in_run(bench, jump) == ENCODER_JUMP
    assert bench.fault[1] == jump
    assert bench.sample["fault_class"] == 7


def test_160_counts_are_speed(core: Core) -> None:
    bench = Bench(core)
    bench.arm()
    assert tick_in_run(bench, 160) == 0
    assert tick_in_run(bench) == OVER_SPEED
    assert bench.fault[1] == 80_000  # over twice the time


def test_eight_counts_are_never_a_jump(core: Core) -> None:
    for step, code in [(8, OVER_SPEED), (9, 0)]:
        bench = Bench(core, speed_limit_counts_s=1)
        bench.arm()
        assert tick_in_run(bench, step) == 0
        assert tick_in_run(bench) == code


@pytest.mark.parametrize(("between", "code"), [(97, ENCODER_JUMP), (98, 0)])
def test_jumps_within_100_periods(core: Core, between: int, code: int) -> None:
    bench = Bench(core)
    bench.arm()
    tick_in_run(bench, 1000)
    for _ in range(between):
        tick_in_run(bench)
    tick_in_run(bench, 1000)
    assert tick_in_run(bench, 1000) == code


@pytest.mark.sampled
@pytest.mark.parametrize("period", [1000, 100])
@pytest.mark.parametrize("speed", [0, 32_700, -32_700])
def test_one_wrong_count_of_any_size_does_not_show(core: Core, period: int, speed: int) -> None:
    """Every size there is, up and down; backwards, and in the slow builds of the gates, up to 2^11."""
    slow = PREBUILT in os.environ or speed < 0
    assert core.lib.check_wrong_counts(32_768, period, speed, 1, 1 << (11 if slow else 23)) == 0


@pytest.mark.parametrize("period", [50, 300, 333, 500, 1000, 1500, 45000])
@pytest.mark.parametrize("limit", [9, 1000, 40_000, 1_000_000])
def test_one_wrong_count_at_other_rates(core: Core, period: int, limit: int) -> None:
    jump = max(8, 4 * limit * period // 1_000_000)
    for percent in (-100, -70, -20, 5, 40, 90, 100):
        for about in (250, jump * 3 // 4, jump, jump * 5 // 4):  # one way or both are jumps
            sizes = max(1, about - 250), about + 250
            assert core.lib.check_wrong_counts(limit, period, limit * percent // 100, *sizes) == 0


_SIZES = [1, 41, 42, 82, 83, 119, 120, 121, 160, 161, 200, 201, 5000, 1 << 22, 1 << 23]


@pytest.mark.parametrize("size", _SIZES)
@pytest.mark.parametrize("direction", [-1, 1])
@pytest.mark.parametrize(("period", "fast"), [(1000, 40), (100, 4)])
@pytest.mark.parametrize("way", [-1, 0, 1])
def test_one_wrong_count_in_run(
    core: Core, size: int, direction: int, period: int, fast: int, way: int
) -> None:
    speed = way * fast
    bench = Bench(core, period_us=period)
    bench.arm()
    for _ in range(25):
        assert tick_in_run(bench, speed) == 0
    assert tick_in_run(bench, speed + direction * size) == 0
    assert bench.sample["position_counts"] == bench.counts % (1 << 24)  # as it was read
    assert tick_in_run(bench, speed - direction * size) == 0
    for _ in range(25):
        assert tick_in_run(bench, speed) == 0
    assert bench.device.encoder.position == 52 * speed
    assert bench.state == RUN


@pytest.mark.parametrize("direction", [-1, 1])
def test_one_wrong_count_is_no_travel(core: Core, direction: int) -> None:
    bench = Bench(core, travel_limit_counts=10)
    bench.arm()
    assert tick_in_run(bench, direction * 10) == 0
    assert tick_in_run(bench, direction * 30) == 0
    assert tick_in_run(bench, -direction * 30) == 0
    for _ in range(5):
        assert tick_in_run(bench) == 0
    assert tick_in_run(bench, direction) == 0
    assert tick_in_run(bench) == OVER_TRAVEL


@pytest.mark.parametrize("direction", [-1, 1])
def test_one_wrong_count_at_arming_is_no_origin(core: Core, direction: int) -> None:
    bench = Bench(core, travel_limit_counts=100)
    bench.hello()
    for k in range(10):
        bench.counts = direction * 50 * (k == 9)
        bench.tick()
        assert bench.drive()
    assert bench.state == RUN
    bench.counts = 0
    assert tick_in_run(bench) == 0
    assert bench.device.encoder.origin == 0


@pytest.mark.parametrize(("size", "code"), [(82, 0), (83, OVER_SPEED), (120, OVER_SPEED), (160, OVER_SPEED)])
@pytest.mark.parametrize("direction", [-1, 1])
def test_two_wrong_counts_in_a_row_show(core: Core, size: int, code: int, direction: int) -> None:
    """Up to 82, half the way each tick and one wrong count would look the same."""
    bench = Bench(core)
    bench.arm()
    assert tick_in_run(bench, direction * size) == 0
    assert tick_in_run(bench) == code
    assert tick_in_run(bench, -direction * size) == code


def test_two_wrong_counts_in_a_row_show_at_10_khz(core: Core) -> None:
    for wrong, codes in [([12, 12], [0, OVER_SPEED]), ([12, 0], [0, 0])]:
        bench = Bench(core, period_us=100)
        bench.arm()
        for _ in range(25):
            assert tick_in_run(bench, 4) == 0
        for before, error, code in zip([0, *wrong], wrong, codes, strict=False):
            assert tick_in_run(bench, 4 + error - before) == code
