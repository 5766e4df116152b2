"""Counts that wrap, and the speed limit over 1, 2 and 8 ms."""

import random
from typing import Any

import pytest

from tests.firmware.bench import SESSION, Bench, Core
from tests.firmware.encoder_bench import OVER_SPEED, speed_limits, tick_in_run


@pytest.mark.parametrize("around", [1 << 15, 1 << 23, 1 << 24, 1 << 31, 1 << 32, 0])
@pytest.mark.parametrize("direction", [-1, 1])
def test_counters_wrap(core: Core, around: int, direction: int) -> None:
    bench = Bench(core, boot=False)
    bench.counts = around - direction * 900
    bench.tick()
    bench.arm()
    for i in range(200):
        assert tick_in_run(bench, direction * 10) == 0
        assert bench.sample["position_counts"] == bench.counts % (1 << 24)
        speed = core.lib.dcmp_encoder_speed(
            core.ffi.addressof(bench.device.encoder), speed_limits(core, 40000)
        )
        assert speed == (direction * 10_000 if i else 0)  # one tick later
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
@pytest.mark.parametrize("limit", [1000, 40000, 1_000_000])
@pytest.mark.parametrize("direction", [-1, 1])
def test_speed_limit(core: Core, period: int, limit: int, direction: int) -> None:
    """One count more than the speed says is allowed, two are not; one tick later."""
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
        for i in range(1, span + 2 if code else 2 * span + 4):
            codes.append(tick_in_run(bench, direction * (total * i // span - done)))
            done = total * i // span
        assert codes[-1] == code
        assert set(codes[:-1]) == {0}
        if code:
            assert bench.fault[1] == direction * (total * 1_000_000 // window)
            assert bench.output() == (0, False)


@pytest.mark.parametrize(("period", "window"), [(50, 160), (300, 27), (1000, 8), (1500, 6), (7999, 2)])
@pytest.mark.parametrize("limit", [1, 300, 1303, 2000])
@pytest.mark.parametrize("direction", [-1, 1])
def test_a_low_speed_limit_is_found_over_8_ms(
    core: Core, period: int, window: int, limit: int, direction: int
) -> None:
    """A count more than the limit is borne over 8 ms, two are not; over 1 and 2 ms neither shows."""
    allowed = limit * window * period // 1_000_000 + 1
    for extra, code in [(0, 0), (1, OVER_SPEED)]:
        bench = Bench(core, period_us=period, watchdog_ms=50)
        _lower_speed(bench, limit)
        bench.arm()
        total, done, codes = allowed + extra, 0, []
        for i in range(1, window + 2 if code else 3 * window):
            codes.append(tick_in_run(bench, direction * (total * i // window - done)))
            done = total * i // window
        assert codes[-1] == code
        assert set(codes[:-1]) == {0}
        if code:
            assert bench.fault[1] == direction * (total * 1_000_000 // (window * period))
            assert bench.output() == (0, False)


def test_over_1_and_2_ms_what_the_board_was_built_with_holds(core: Core) -> None:
    """A tremble is fast over 1 ms: under a low limit of a session it is none; nor is it a jump."""
    bench = Bench(core)
    _lower_speed(bench, 1000)
    bench.arm()
    for step in (3, -2, 3, -2, 4, -5, 0, 0, 40, -40, 0, 0, 12, -12, 0, 0, 9, -9, *[0] * 11):
        assert tick_in_run(bench, step) == 0
    assert bench.device.encoder.jumps.count == 0
    assert tick_in_run(bench, 41) == 0
    assert tick_in_run(bench, 41) == OVER_SPEED  # over 8 ms; over 1 ms it is what the board bears
    assert bench.fault[1] == 41 * 1000 // 8


def _lower_speed(bench: Bench, limit: int) -> None:
    bench.hello()
    assert bench.ask("PARAMETER_SET", session=SESSION, id=10, value=limit)["result"] == 0


@pytest.mark.parametrize("direction", [-1, 1])
def test_a_steady_speed_at_a_low_limit_is_borne(core: Core, direction: int) -> None:
    """2 rad/s of 4096 counts, at any position between two counts; 15 % more is found."""
    for phase in range(10):
        for share, code in [(1.0, 0), (1.15, OVER_SPEED)]:
            bench = Bench(core)
            _lower_speed(bench, 1303)
            bench.arm()
            start, last = bench.counts, 0
            for i in range(200):
                now = start + direction * int(share * 1.303 * i + phase / 10)
                last = tick_in_run(bench, now - bench.counts)
            assert last == code


def test_a_steady_speed_at_the_limit_is_borne(core: Core) -> None:
    bench = Bench(core, period_us=300)
    bench.arm()
    for _ in range(300):
        assert tick_in_run(bench, 12) == 0  # 40,000 counts/s
    assert tick_in_run(bench, 13) == 0
    assert tick_in_run(bench, 13) == 0
    assert tick_in_run(bench, 13) == OVER_SPEED
    assert bench.fault[1] == 50 * 1_000_000 // 1200  # of the tick before


def test_reports_stop_at_32_bits(core: Core) -> None:
    encoder = core.new("struct dcmp_encoder *")
    core.lib.dcmp_encoder_init(encoder, 50)
    top, bottom = (1 << 31) - 1, -(1 << 31)
    for position, change, travel, speed in [
        (1 << 40, 1 << 30, top, top), (-(1 << 40), -(1 << 30), bottom, bottom), (-5, -5, -5, -5000),
    ]:  # fmt: skip
        for ago in range(5):
            encoder.past[-ago % len(encoder.past)] = position + (1 - ago) * change
        assert core.lib.dcmp_encoder_travel(encoder) == travel
        assert core.lib.dcmp_encoder_speed(encoder, speed_limits(core, 1 << 30)) == speed


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
    assert tick_in_run(bench, 60) == 0
    assert tick_in_run(bench, 60) == OVER_SPEED


def test_the_shortest_period_looks_back_as_far(core: Core) -> None:
    """160 periods from each of three ticks; over 20 and 40 periods nothing is too fast."""
    encoder = core.new("struct dcmp_encoder *")
    for farthest, speed in [(322, 40_250), (321, 0)]:  # 1 more than the limit, and 2
        core.lib.dcmp_encoder_init(encoder, 50)
        for i in range(len(encoder.past)):
            encoder.past[i] = 322
        encoder.past[-2 % len(encoder.past)] = farthest
        for ago, position in [(160, 0), (161, 400), (162, 0)]:
            encoder.past[-ago % len(encoder.past)] = position
        assert core.lib.dcmp_encoder_too_fast(encoder, speed_limits(core, 40_000)) == (speed > 0)
        assert core.lib.dcmp_encoder_speed(encoder, speed_limits(core, 40_000)) == speed


@pytest.mark.parametrize("direction", [-1, 1])
def test_over_speed_is_found_within_two_milliseconds(core: Core, direction: int) -> None:
    """From rest, at every speed that is no jump: one tick after the change over 1 ms is too large."""
    for period, steps, allowed in [(1000, range(42, 161), 41), (100, range(5, 17), 41)]:
        for step in steps:
            bench = Bench(core, period_us=period)
            bench.arm()
            too_far = allowed // step + 1  # ticks
            codes = [tick_in_run(bench, direction * step) for _ in range(too_far + 1)]
            assert codes == [0] * too_far + [OVER_SPEED]
            assert len(codes) * period <= 2000
