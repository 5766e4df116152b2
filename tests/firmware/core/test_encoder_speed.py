"""Counts that wrap, speed, travel, jumps, one wrong count."""

import os
import random
from typing import Any

import pytest

from tests.firmware.bench import SESSION, Bench, Core
from tests.firmware.core_library import PREBUILT

RUN, FAULT = 3, 4
ORIGIN = 16
OVER_SPEED, OVER_TRAVEL, ENCODER_JUMP = 5, 6, 7


def _limits(core: Core, built: int) -> Any:
    return core.new("struct dcmp_speed_limits *", (built, built))


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
    for i in range(200):
        assert _tick(bench, direction * 10) == 0
        assert bench.sample["position_counts"] == bench.counts % (1 << 24)
        speed = core.lib.dcmp_encoder_speed(core.ffi.addressof(bench.device.encoder), _limits(core, 40000))
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
            codes.append(_tick(bench, direction * (total * i // span - done)))
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
            codes.append(_tick(bench, direction * (total * i // window - done)))
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
        assert _tick(bench, step) == 0
    assert bench.device.encoder.jumps.count == 0
    assert _tick(bench, 41) == 0
    assert _tick(bench, 41) == OVER_SPEED  # over 8 ms; over 1 ms it is what the board bears
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
                last = _tick(bench, now - bench.counts)
            assert last == code


def test_a_steady_speed_at_the_limit_is_borne(core: Core) -> None:
    bench = Bench(core, period_us=300)
    bench.arm()
    for _ in range(300):
        assert _tick(bench, 12) == 0  # 40,000 counts/s
    assert _tick(bench, 13) == 0
    assert _tick(bench, 13) == 0
    assert _tick(bench, 13) == OVER_SPEED
    assert bench.fault[1] == 50 * 1_000_000 // 1200  # of the tick before


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
    assert _tick(bench, direction) == 0
    assert _tick(bench) == OVER_TRAVEL
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


def _from_origin(core: Core, origin: int, start: int = 0, **config: Any) -> Bench:
    bench = Bench(core, boot=False, **config)
    bench.counts = start
    bench.tick()
    bench.hello()
    answer = bench.ask("PARAMETER_SET", session=SESSION, id=ORIGIN, value=origin)
    assert answer["result"] == 0
    return bench


@pytest.mark.parametrize("start", [300, (1 << 24) - 40, (1 << 23) + 17])
@pytest.mark.parametrize("from_origin", [0, 60, -60])
@pytest.mark.parametrize("direction", [-1, 1])
def test_travel_counts_from_an_origin_that_was_given(
    core: Core, start: int, from_origin: int, direction: int
) -> None:
    """Armed anywhere, an arm may go as far from the origin as the limit says, either way."""
    bench = _from_origin(core, (start - from_origin) % (1 << 24), start)
    assert bench.ask("PARAMETER_SET", session=SESSION, id=11, value=100)["result"] == 0
    bench.arm()
    way = 100 - direction * from_origin
    for _ in range(way // 20):
        assert _tick(bench, direction * 20) == 0
    for _ in range(5):
        assert _tick(bench) == 0
    assert _tick(bench, direction) == 0
    assert _tick(bench) == OVER_TRAVEL
    assert bench.fault[1] == direction * 101


def test_an_arm_that_is_too_far_from_the_origin_does_not_run(core: Core) -> None:
    for origin, code in [(100, 0), (101, OVER_TRAVEL)]:
        bench = _from_origin(core, origin)
        bench.ask("PARAMETER_SET", session=SESSION, id=11, value=100)
        for _ in range(10):
            bench.drive()
            bench.tick()
        assert bench.fault == (code, -101 if code else 0)


@pytest.mark.parametrize("direction", [-1, 1])
def test_one_wrong_count_is_no_travel_from_the_origin(core: Core, direction: int) -> None:
    for wrong in (30, 5000, 1 << 22):
        bench = _from_origin(core, 0)
        bench.ask("PARAMETER_SET", session=SESSION, id=11, value=10)
        bench.arm()
        assert _tick(bench, direction * wrong) == 0
        assert _tick(bench, -direction * wrong) == 0
        for _ in range(5):
            assert _tick(bench) == 0


@pytest.mark.parametrize("direction", [-1, 1])
def test_no_origin_leads_beyond_what_the_board_was_built_with(core: Core, direction: int) -> None:
    """A session may call any count its origin; what the board was built with counts from the first arming."""
    bench = _from_origin(core, direction * 300 % (1 << 24), travel_limit_counts=500)
    bench.arm()
    for _ in range(25):
        assert _tick(bench, direction * 20) == 0
    assert _tick(bench, direction) == 0
    assert _tick(bench) == OVER_TRAVEL
    assert bench.fault[1] == direction * 501


def test_the_travel_of_a_session_is_looked_at_first(core: Core) -> None:
    """Both limits are passed in one tick."""
    bench = _from_origin(core, 5, travel_limit_counts=30)
    bench.arm()
    for step, code in [(-25, 0), (-30, 0), (0, OVER_TRAVEL)]:
        assert _tick(bench, step) == code
    assert bench.fault[1] == -60


@pytest.mark.parametrize("first", [7, 5000, (1 << 24) - 3])
def test_distance_is_the_middle_one_of_three_counts(core: Core, first: int) -> None:
    """Before the first count there is none."""
    encoder = core.new("struct dcmp_encoder *")
    core.lib.dcmp_encoder_init(encoder, 1000)
    for moved, distance in [(0, 0), (40, 0), (80, 40), (50, 50), (50, 50), (-(1 << 23), 50), (-7, -7)]:
        core.lib.dcmp_encoder_tick(encoder, (first + moved) % (1 << 32), 1 << 30, 1000)
        assert core.lib.dcmp_encoder_distance(encoder, first % (1 << 24)) == distance


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
        assert core.lib.dcmp_encoder_speed(encoder, _limits(core, 1 << 30)) == speed


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
    assert _tick(bench, 160) == 0
    assert _tick(bench) == OVER_SPEED
    assert bench.fault[1] == 80_000  # over twice the time


def test_eight_counts_are_never_a_jump(core: Core) -> None:
    for step, code in [(8, OVER_SPEED), (9, 0)]:
        bench = Bench(core, speed_limit_counts_s=1)
        bench.arm()
        assert _tick(bench, step) == 0
        assert _tick(bench) == code


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
    assert _tick(bench, 60) == 0
    assert _tick(bench, 60) == OVER_SPEED


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
        assert _tick(bench, speed) == 0
    assert _tick(bench, speed + direction * size) == 0
    assert bench.sample["position_counts"] == bench.counts % (1 << 24)  # as it was read
    assert _tick(bench, speed - direction * size) == 0
    for _ in range(25):
        assert _tick(bench, speed) == 0
    assert bench.device.encoder.position == 52 * speed
    assert bench.state == RUN


@pytest.mark.parametrize("direction", [-1, 1])
def test_one_wrong_count_is_no_travel(core: Core, direction: int) -> None:
    bench = Bench(core, travel_limit_counts=10)
    bench.arm()
    assert _tick(bench, direction * 10) == 0
    assert _tick(bench, direction * 30) == 0
    assert _tick(bench, -direction * 30) == 0
    for _ in range(5):
        assert _tick(bench) == 0
    assert _tick(bench, direction) == 0
    assert _tick(bench) == OVER_TRAVEL


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
    assert _tick(bench) == 0
    assert bench.device.encoder.origin == 0


@pytest.mark.parametrize(("size", "code"), [(82, 0), (83, OVER_SPEED), (120, OVER_SPEED), (160, OVER_SPEED)])
@pytest.mark.parametrize("direction", [-1, 1])
def test_two_wrong_counts_in_a_row_show(core: Core, size: int, code: int, direction: int) -> None:
    """Up to 82, half the way each tick and one wrong count would look the same."""
    bench = Bench(core)
    bench.arm()
    assert _tick(bench, direction * size) == 0
    assert _tick(bench) == code
    assert _tick(bench, -direction * size) == code


def test_two_wrong_counts_in_a_row_show_at_10_khz(core: Core) -> None:
    for wrong, codes in [([12, 12], [0, OVER_SPEED]), ([12, 0], [0, 0])]:
        bench = Bench(core, period_us=100)
        bench.arm()
        for _ in range(25):
            assert _tick(bench, 4) == 0
        for before, error, code in zip([0, *wrong], wrong, codes, strict=False):
            assert _tick(bench, 4 + error - before) == code


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
        assert core.lib.dcmp_encoder_too_fast(encoder, _limits(core, 40_000)) == (speed > 0)
        assert core.lib.dcmp_encoder_speed(encoder, _limits(core, 40_000)) == speed


@pytest.mark.parametrize("direction", [-1, 1])
def test_over_speed_is_found_within_two_milliseconds(core: Core, direction: int) -> None:
    """From rest, at every speed that is no jump: one tick after the change over 1 ms is too large."""
    for period, steps, allowed in [(1000, range(42, 161), 41), (100, range(5, 17), 41)]:
        for step in steps:
            bench = Bench(core, period_us=period)
            bench.arm()
            too_far = allowed // step + 1  # ticks
            codes = [_tick(bench, direction * step) for _ in range(too_far + 1)]
            assert codes == [0] * too_far + [OVER_SPEED]
            assert len(codes) * period <= 2000
