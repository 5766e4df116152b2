import pytest

from tests.firmware.bench import CONFIG, SESSION, Bench, Core

OK, UNKNOWN, READ_ONLY, OUT_OF_RANGE, NOT_IDLE, NOT_OWNER = range(6)
VALUE_MAX = (1 << 31) - 1
BUILT = {
    1: CONFIG["board"],
    2: 7,
    3: 1,
    4: 0,
    5: 4096,
    6: 1000,
    7: 10000,
    8: 0,
    9: 20,
    10: 40000,
    11: 20000,
    12: 0,
    13: 5,
    14: -41234,
    15: 24000,
    16: -1,
}
RANGES = {
    7: (1, 10000),
    8: (1, VALUE_MAX),
    9: (5, 20),
    10: (1, 40000),
    11: (1, 20000),
    12: (0, 1),
    16: (-1, (1 << 24) - 1),
}


def _set(bench: Bench, number: int, value: int, session: int = SESSION) -> tuple[int, int]:
    answer = bench.ask("PARAMETER_SET", session=session, id=number, value=value)
    assert answer["id"] == number
    return answer["result"], answer["value"]


@pytest.mark.parametrize("state", range(5))
def test_get_in_every_state(core: Core, state: int) -> None:
    for number in range(256):
        bench = Bench(core, boot=state != 0)
        bench.go_to(state)
        answer = bench.ask("PARAMETER_GET", id=number)
        value = bench.device.tick if number == 4 and state else BUILT.get(number, 0)
        assert answer == {"id": number, "value": value, "result": OK if number in BUILT else UNKNOWN}


@pytest.mark.parametrize("number", RANGES)
def test_the_range(core: Core, number: int) -> None:
    bench = Bench(core)
    bench.hello()
    low, high = RANGES[number]
    for value in [high, low]:
        assert _set(bench, number, value) == (OK, value)
        assert bench.ask("PARAMETER_GET", id=number)["value"] == value
        for outside in [low - 1, high + 1, -(1 << 31), VALUE_MAX]:
            if -(1 << 31) <= outside <= VALUE_MAX and not low <= outside <= high:
                assert _set(bench, number, outside) == (OUT_OF_RANGE, value)


def test_a_slew_that_the_board_was_built_with_can_be_lowered_only(core: Core) -> None:
    bench = Bench(core, slew_mV_per_ms=200)
    bench.hello()
    assert _set(bench, 8, 201) == (OUT_OF_RANGE, 200)
    assert _set(bench, 8, 0) == (OUT_OF_RANGE, 200)
    assert _set(bench, 8, 3) == (OK, 3)
    assert _set(bench, 8, 200) == (OK, 200)


@pytest.mark.parametrize("built", [5, 6, 20, 49, 50])
def test_the_watchdog_s_time_can_be_lowered_only(core: Core, built: int) -> None:
    """For any requested time, 0 V comes within what the board was built with and a tick."""
    bench = Bench(core, watchdog_ms=built)
    bench.hello()
    for asked in (built + 1, 50, 51, VALUE_MAX):
        assert asked <= built or _set(bench, 9, asked) == (OUT_OF_RANGE, built)
    assert _set(bench, 9, 5) == (OK, 5)
    assert _set(bench, 9, built) == (OK, built)
    bench.arm()
    bench.drive(1000, ttl_ms=50)
    bench.tick(built)
    assert bench.state == 3
    bench.tick(2)
    assert bench.state == 4


def test_a_board_without_edge_stamps(core: Core) -> None:
    bench = Bench(core, edge_stamps=False)
    bench.hello()
    assert _set(bench, 12, 1) == (OUT_OF_RANGE, 0)
    assert _set(bench, 12, 0) == (OK, 0)


def test_who_may_and_when(core: Core) -> None:
    bench = Bench(core)
    assert _set(bench, 9, 15, session=0) == (NOT_OWNER, 20)
    assert _set(bench, 9, 15) == (NOT_OWNER, 20)
    bench.hello()
    assert _set(bench, 9, 15, session=9) == (NOT_OWNER, 20)
    assert _set(bench, 0, 30) == (UNKNOWN, 0)
    assert _set(bench, 15, 30) == (READ_ONLY, 24000)
    assert _set(bench, 17, 30) == (UNKNOWN, 0)
    for number in (*range(1, 7), 13, 14):
        assert _set(bench, number, BUILT[number]) == (READ_ONLY, BUILT[number])
    for state in (2, 3, 4):
        bench = Bench(core)
        bench.go_to(state)
        assert _set(bench, 9, 15) == (NOT_IDLE, 20)


def test_the_first_reason_is_answered(core: Core) -> None:
    bench = Bench(core)
    bench.go_to(3)
    assert _set(bench, 200, 0, session=9) == (UNKNOWN, 0)
    assert _set(bench, 1, 0, session=9) == (READ_ONLY, 1)
    assert _set(bench, 9, 0, session=9) == (OUT_OF_RANGE, 20)
    assert _set(bench, 9, 15, session=9) == (NOT_IDLE, 20)


@pytest.mark.parametrize("way", ["release", "lease"])
def test_what_a_session_changed_ends_with_it(core: Core, way: str) -> None:
    """The board is as it was built, before the next session owns it and after."""
    bench = Bench(core, slew_mV_per_ms=200)
    bench.hello()
    for number, (low, _) in RANGES.items():
        assert _set(bench, number, max(low, 1)) == (OK, max(low, 1))
    bench.tick(5)
    bench.hello()
    for number, (low, _) in RANGES.items():
        assert bench.ask("PARAMETER_GET", id=number)["value"] == max(low, 1)  # the same session
    if way == "release":
        bench.drive(arm=0, release=1)
    else:
        bench.tick(500)
    for owner in (0, 9):
        assert not bench.hello(owner)["busy"]
        for number, value in {**BUILT, 4: bench.device.tick, 8: 200}.items():
            assert bench.ask("PARAMETER_GET", id=number)["value"] == value


def test_lowered_limits_hold(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    assert _set(bench, 7, 2000) == (OK, 2000)
    assert _set(bench, 8, 50) == (OK, 50)
    assert _set(bench, 10, 1000) == (OK, 1000)
    bench.arm()
    for _ in range(60):
        bench.drive(9000)
        bench.tick()
    assert bench.output() == (2000, True)
    for fault in [*[(0, 0)] * 4, (5, 1500)]:
        bench.counts += 3
        bench.drive(0)
        bench.tick()
        assert bench.fault == fault


LIMITS = {
    "period_us": (50, 100000),
    "voltage_limit_mV": (1, 32767),
    "slew_mV_per_ms": (0, VALUE_MAX),
    "watchdog_ms": (5, 50),
    "speed_limit_counts_s": (1, VALUE_MAX),
    "travel_limit_counts": (1, VALUE_MAX),
    "supply_mV": (0, VALUE_MAX),
    "node": (0, 15),
    "counts_per_rev": (1, VALUE_MAX),
}


@pytest.mark.parametrize("field", LIMITS)
def test_a_configuration_outside_its_ranges(core: Core, field: str) -> None:
    low, high = LIMITS[field]
    for fine in (low, high):
        assert Bench(core, boot=False, **{field: fine}).valid
    for wrong in (low - 1, high + 1):
        if wrong > VALUE_MAX or (field == "node" and wrong < 0):
            continue
        bench = Bench(core, boot=False, **{field: wrong})
        assert not bench.valid
        bench.send("HELLO", session=1, protocol_hash=core.lib.check_protocol_hash())
        bench.send("STOP", reason=0)
        bench.corrupt(20)
        assert bench.device.health.report.crc_errors == 0
        core.lib.dcmp_device_link(bench.device, False, 0)
        core.lib.dcmp_device_link(bench.device, True, 0)
        for _ in range(200):
            assert bench.tick() == (0, False)
        assert bench.output() == (0, False)
        assert bench.seen == []
