"""Counts that wrap, speed, travel, jumps."""

import random
from typing import Any

import pytest

from tests.firmware.bench import Bench, Core

RUN, FAULT = 3, 4
OVER_SPEED, OVER_TRAVEL, ENCODER_JUMP = 5, 6, 7


def _tick(bench: Bench, step: int = 0) -> int:
    """Turn, with a host that goes on driving; return the latched code."""
    bench.counts += step
    bench.drive(100)
    bench.tick()
    return bench.fault[0]


@pytest.mark.parametrize("around", [1 << 15, 1 << 23, 1 << 24, 1 << 31, 1 << 32, 0])
@pytest.mark.parametrize("direction", [-1, 1])
def test_counters_wrap(core: Core, around: int, direction: int) -> None:
    bench = Bench(core, boot=False)
    bench.counts = around - direction * 900
    bench.tick()
    bench.arm()
    for _ in range(200):
        assert _tick(bench, direction * 10) == 0
        assert bench.sample["position_counts"] == bench.counts % (1 << 24)
        assert bench.device.encoder.change == direction * 10
    assert bench.device.encoder.position == direction * 2000


def test_the_shortest_way(core: Core) -> None:
    encoder = core.new("struct dcmp_encoder *")
    rng = random.Random(6)
    steps = [(1 << 23) - 1, -(1 << 23), -(1 << 23) + 1, 0, 1, -1]
    for step in steps + [rng.randrange(-(1 << 23), 1 << 23) for _ in range(200)]:
        core.lib.dcmp_encoder_init(encoder, 1000)
        first = rng.randrange(1 << 32)
        core.lib.dcmp_encoder_tick(encoder, first, 1, 1000)
        core.lib.dcmp_encoder_tick(encoder, (first + step) % (1 << 32), (1 << 31) - 1, 1000)
        assert (encoder.position, encoder.jumped) == (step, False)


@pytest.mark.parametrize("period", [50, 300, 1000, 1500, 45000])
@pytest.mark.parametrize("limit", [1, 1000, 40000, 1_000_000])
@pytest.mark.parametrize("direction", [-1, 1])
def test_speed_limit(core: Core, period: int, limit: int, direction: int) -> None:
    """One count more than the speed says is allowed, two are not."""
    span = -(-1000 // period)
    window = span * period
    allowed = limit * window // 1_000_000 + 1
    config: dict[str, Any] = {
        "period_us": period,
        "speed_limit_counts_s": limit,
        "travel_limit_counts": (1 << 31) - 1,
    }
    config["watchdog_ms"] = 50
    for extra, code in [(0, 0), (1, OVER_SPEED)]:
        bench = Bench(core, **config)
        bench.arm()
        total, done, codes = allowed + extra, 0, []
        for i in range(1, span + 1):
            codes.append(_tick(bench, direction * (total * i // span - done)))
            done = total * i // span
        assert codes[-1] == code
        assert set(codes[:-1]) <= {0}
        if code:
            assert bench.fault[1] == direction * (total * 1_000_000 // window)
            assert bench.output() == (0, False)


def test_a_steady_speed_at_the_limit_is_borne(core: Core) -> None:
    bench = Bench(core, period_us=300)
    bench.arm()
    for _ in range(300):
        assert _tick(bench, 12) == 0  # 40,000 counts/s
    assert _tick(bench, 13) == 0
    assert _tick(bench, 13) == OVER_SPEED


@pytest.mark.parametrize("direction", [-1, 1])
def test_travel(core: Core, direction: int) -> None:
    bench = Bench(core, travel_limit_counts=100)
    for _ in range(50):
        bench.counts += 10
        bench.tick()
    assert bench.state == 1
    bench.arm()
    for _ in range(10):
        assert _tick(bench, direction * 10) == 0
    assert _tick(bench, direction) == OVER_TRAVEL
    assert bench.fault[1] == direction * 101


def test_travel_counts_from_the_first_arming(core: Core) -> None:
    bench = Bench(core, travel_limit_counts=100)
    bench.arm()
    bench.drive(arm=0)
    for _ in range(11):
        bench.counts += 10
        bench.tick()
    bench.hello()
    for _ in range(10):
        bench.drive()
        bench.tick()
    assert bench.fault == (OVER_TRAVEL, 110)


def test_reports_stop_at_32_bits(core: Core) -> None:
    encoder = core.new("struct dcmp_encoder *")
    core.lib.dcmp_encoder_init(encoder, 50)
    top, bottom = (1 << 31) - 1, -(1 << 31)
    for position, change, travel, speed in [
        (1 << 40, 1 << 30, top, top), (-(1 << 40), -(1 << 30), bottom, bottom), (-5, -5, -5, -5000),
    ]:  # fmt: skip
        encoder.position, encoder.change = position, change
        assert core.lib.dcmp_encoder_travel(encoder) == travel
        assert core.lib.dcmp_encoder_speed(encoder) == speed


@pytest.mark.parametrize("jump", [161, -161, 5000, -100000, 1 << 22])
def test_one_jump_or_two_are_borne_three_are_not(core: Core, jump: int) -> None:
    """Four times 40,000 counts/s are 160 counts in a period."""
    bench = Bench(core)
    bench.arm()
    assert _tick(bench, jump) == 0
    assert _tick(bench, 3) == 0
    assert _tick(bench, -jump) == 0
    assert _tick(bench) == 0
    assert bench.device.encoder.position == 3
    assert _tick(bench, jump) == ENCODER_JUMP
    assert bench.fault[1] == jump
    assert bench.sample["fault_class"] == 7


def test_160_counts_are_speed(core: Core) -> None:
    bench = Bench(core)
    bench.arm()
    assert _tick(bench, 160) == OVER_SPEED


def test_eight_counts_are_never_a_jump(core: Core) -> None:
    for step, code in [(8, OVER_SPEED), (9, 0)]:
        bench = Bench(core, speed_limit_counts_s=1)
        bench.arm()
        assert _tick(bench, step) == code


@pytest.mark.parametrize(("between", "code"), [(97, ENCODER_JUMP), (98, 0)])
def test_jumps_within_100_periods(core: Core, between: int, code: int) -> None:
    bench = Bench(core)
    bench.arm()
    _tick(bench, 1000)
    for _ in range(between):
        _tick(bench)
    _tick(bench, 1000)
    assert _tick(bench, 1000) == code


def test_limits_are_for_run(core: Core) -> None:
    bench = Bench(core)
    for _ in range(20):
        bench.counts += 150
        bench.tick()
        bench.counts += 100000
        bench.tick()
    assert bench.fault == (0, 0)


def test_the_first_cause_of_a_tick(core: Core) -> None:
    """Speed and travel at once: speed is looked at first."""
    bench = Bench(core, travel_limit_counts=50)
    bench.arm()
    assert _tick(bench, 60) == OVER_SPEED
