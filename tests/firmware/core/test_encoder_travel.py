"""The travel limit, from the first arming and from an origin that was given."""

from typing import Any

import pytest

from tests.firmware.bench import SESSION, Bench, Core
from tests.firmware.encoder_bench import ORIGIN, OVER_TRAVEL, tick_in_run


@pytest.mark.parametrize("direction", [-1, 1])
def test_travel(core: Core, direction: int) -> None:
    bench = Bench(core, travel_limit_counts=100)
    for _ in range(50):
        bench.counts += 10
        bench.tick()
    assert bench.state == 1
    bench.arm()
    for _ in range(10):
        assert tick_in_run(bench, direction * 10) == 0
    assert tick_in_run(bench, direction) == 0
    assert tick_in_run(bench) == OVER_TRAVEL
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
        assert tick_in_run(bench, direction * 20) == 0
    for _ in range(5):
        assert tick_in_run(bench) == 0
    assert tick_in_run(bench, direction) == 0
    assert tick_in_run(bench) == OVER_TRAVEL
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
        assert tick_in_run(bench, direction * wrong) == 0
        assert tick_in_run(bench, -direction * wrong) == 0
        for _ in range(5):
            assert tick_in_run(bench) == 0


@pytest.mark.parametrize("direction", [-1, 1])
def test_no_origin_leads_beyond_what_the_board_was_built_with(core: Core, direction: int) -> None:
    """A session may call any count its origin; what the board was built with counts from the first arming."""
    bench = _from_origin(core, direction * 300 % (1 << 24), travel_limit_counts=500)
    bench.arm()
    for _ in range(25):
        assert tick_in_run(bench, direction * 20) == 0
    assert tick_in_run(bench, direction) == 0
    assert tick_in_run(bench) == OVER_TRAVEL
    assert bench.fault[1] == direction * 501


def test_the_travel_of_a_session_is_looked_at_first(core: Core) -> None:
    """Both limits are passed in one tick."""
    bench = _from_origin(core, 5, travel_limit_counts=30)
    bench.arm()
    for step, code in [(-25, 0), (-30, 0), (0, OVER_TRAVEL)]:
        assert tick_in_run(bench, step) == code
    assert bench.fault[1] == -60


@pytest.mark.parametrize("first", [7, 5000, (1 << 24) - 3])
def test_distance_is_the_middle_one_of_three_counts(core: Core, first: int) -> None:
    """Before the first count there is none."""
    encoder = core.new("struct dcmp_encoder *")
    core.lib.dcmp_encoder_init(encoder, 1000)
    for moved, distance in [(0, 0), (40, 0), (80, 40), (50, 50), (50, 50), (-(1 << 23), 50), (-7, -7)]:
        core.lib.dcmp_encoder_tick(encoder, (first + moved) % (1 << 32), 1 << 30, 1000)
        assert core.lib.dcmp_encoder_distance(encoder, first % (1 << 24)) == distance
