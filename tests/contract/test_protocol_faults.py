"""What docs/protocol.md says of the watchdog, of STOP and of the limits, asked of two devices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.contract import reference_wire as wire
from tests.contract.protocol_host import OTHER_SESSION, Device, Host
from tests.contract.reference_wire import ARMING, FAULTED, IDLE, RUN

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.mark.parametrize(("watchdog_ms", "ttl_ms", "bound"), [(20, 50, 20), (50, 7, 7), (5, 50, 5)])
def test_watchdog(host: Callable[..., Host], watchdog_ms: int, ttl_ms: int, bound: int) -> None:
    h = host(watchdog_ms=watchdog_ms)
    h.arm()
    h.device.advance(100)
    h.drive(2000, arm=1, ttl_ms=ttl_ms)
    at_us = h.device.now_us
    h.drive(2000, arm=1, ttl_ms=ttl_ms)  # the same seq feeds nothing
    while h.device.now_us + 1000 <= at_us + 1000 * bound:
        assert h.tick().state == RUN
    before = h.tick() if h.device.enable else None
    assert (h.device.applied_mV, h.device.enable) == (0, False)
    assert before is None or before.state == FAULTED
    sample = h.tick()
    assert (sample.state, sample.voltage_mV, sample.fault_class) == (FAULTED, 0, wire.HOST_SILENT)
    code, _, age_us = h.fault()
    assert code == wire.HOST_SILENT
    assert 1000 * bound < age_us <= 1000 * bound + 1000


def test_watchdog_ends_arming_without_a_fault(ready: Host) -> None:
    ready.drive(arm=1, ttl_ms=5)
    states = [ready.tick().state for _ in range(7)]
    assert states[:4] == [ARMING] * 4
    assert states[-1] == IDLE


def test_stop_is_obeyed_from_every_host_and_said_ten_times_a_second(running: Host) -> None:
    running.run(3, 3000)
    running.send(wire.STOP, b"\x03")
    assert running.device.applied_mV == 0
    happened = running.ticks & 255
    running.send(wire.STOP, b"\x01")
    running.seen.clear()
    at = []
    for k in range(301):
        sample = running.tick()
        assert (sample.state, sample.fault_class, sample.voltage_mV) == (FAULTED, wire.STOPPED, 0)
        kinds = [number for number, _ in running.seen]
        if wire.FAULT in kinds:
            assert kinds.index(wire.FAULT) < kinds.index(wire.SAMPLE)
            at.append(k)
        running.seen = [m for m in running.seen if m[0] == wire.FAULT][-1:] if k == 300 else []
    assert at == [0, 100, 200, 300]
    assert running.fault() == (wire.STOPPED, happened, 3)


def test_a_fault_is_cleared_by_two_drives_of_one_session(ready: Host) -> None:
    ready.send(wire.STOP, b"\0")

    def after(**word: int) -> int:
        ready.drive(**word)
        return ready.tick().state

    assert after(clear=1) == FAULTED  # no DRIVE without clear since the fault
    assert after(arm=1) == FAULTED
    assert after(release=1) == FAULTED
    assert ready.hello(OTHER_SESSION) == "o"
    assert after(clear=1, session=OTHER_SESSION) == FAULTED  # the other one's DRIVE does not count
    assert after(session=OTHER_SESSION) == FAULTED
    assert after(clear=1, voltage_mV=1, session=OTHER_SESSION) == FAULTED
    assert after(clear=1, session=OTHER_SESSION) == IDLE
    ready.send(wire.STOP, b"\0")
    assert after(clear=1, session=OTHER_SESSION) == FAULTED  # each fault anew


@pytest.mark.parametrize("sign", [1, -1])
def test_speed_limit(running: Host, sign: int) -> None:
    assert running.run(30, moved=sign * 32).state == RUN
    assert running.run(1, 1000, moved=sign * 34).state == RUN  # may be a wrong count
    sample = running.run(1, 1000, moved=sign * 34)
    assert (sample.state, sample.fault_class) == (FAULTED, wire.OVER_SPEED)
    code, tick, detail = running.fault()
    assert (code, tick, abs(detail)) == (wire.OVER_SPEED, sample.tick, 34_000)


def test_travel_limit_counts_from_the_first_arming(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=300)
    for _ in range(100):
        h.tick(30)  # IDLE: no limit
    h.arm()
    assert h.run(10, moved=30).state == RUN
    h.drive(arm=0)
    h.tick()
    h.arm()
    assert h.run(1, moved=1).state == RUN  # may be a wrong count
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 301


@pytest.mark.parametrize("sign", [1, -1])
def test_a_low_speed_limit_shows_over_8_ms(ready: Host, sign: int) -> None:
    assert ready.put(wire.SPEED_LIMIT, 1000) == (wire.OK, 1000)  # 8 counts in 8 ms, and one more
    ready.arm()
    for moved in (1, 1, 1, 1, 1, 1, 1, 1, 2) * 3:
        assert ready.run(1, moved=sign * moved).state == RUN
    for moved in (1, 1, 2):
        assert ready.run(1, moved=sign * moved).state == RUN
    assert ready.run(1, moved=sign).fault_class == wire.OVER_SPEED
    assert abs(ready.fault()[2]) == 1250


def test_travel_from_an_origin_that_was_given(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=300)
    h.tick()
    h.hello()
    assert h.put(wire.TRAVEL_ORIGIN, 2**24 - 50) == (wire.OK, 2**24 - 50)
    assert (
        h.put(wire.TRAVEL_ORIGIN, 2**24) == h.put(wire.TRAVEL_ORIGIN, -2) == (wire.OUT_OF_RANGE, 2**24 - 50)
    )
    assert h.put(wire.TRAVEL_LIMIT, 60) == (wire.OK, 60)
    h.arm()
    assert h.run(5, moved=2).state == RUN
    assert h.run(1, moved=1).state == RUN  # may be a wrong count
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 61


def test_what_the_board_was_built_with_counts_from_the_first_arming(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=30)
    h.tick()
    h.hello()
    assert h.put(wire.TRAVEL_ORIGIN, 25) == (wire.OK, 25)
    h.arm()
    assert h.run(15, moved=2).state == RUN
    assert h.run(1, moved=1).state == RUN
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 31


def test_the_third_jump_within_100_periods(running: Host) -> None:
    for jump in (5000, -7000):
        assert running.run(1, moved=jump).state == RUN
        assert running.run(110, moved=0).state == RUN
    assert running.run(1, moved=9000).state == RUN
    assert running.run(1, moved=131).state == RUN
    assert running.run(1).fault_class == wire.OVER_SPEED  # not above four times 32.768
    assert running.fault()[2] == 65_500  # over twice the time


@pytest.mark.parametrize("wrong", [1, 34, 68, 98, 99, 131, 132, 163, 164, 165, 9000, 2**23 - 1, 2**23])
@pytest.mark.parametrize(("period_us", "speed"), [(1000, 0), (1000, 32), (100, 3)])
def test_one_wrong_count(device: Callable[..., Device], wrong: int, period_us: int, speed: int) -> None:
    """Sizes around one and two times the speed limit, and where one way or both are jumps."""
    for sign in (1, -1):
        h = Host(device(period_us=period_us), "cobs", node=0, first_tick=0)
        h.arm()
        h.run(30, moved=speed)
        sample = h.run(1, moved=speed + sign * wrong)
        assert (sample.state, sample.position) == (RUN, h.counts % 2**24)
        assert h.run(1, moved=speed - sign * wrong).state == RUN
        assert h.run(30, moved=speed).state == RUN


@pytest.mark.parametrize(("wrong", "state"), [(67, RUN), (68, FAULTED), (131, FAULTED)])
def test_two_wrong_counts_in_a_row(running: Host, wrong: int, state: int) -> None:
    assert running.run(1, moved=wrong).state == RUN
    assert running.run(1, moved=0).state == state
    assert running.run(1, moved=-wrong).state == state


def test_one_wrong_count_is_no_travel(host: Callable[..., Host]) -> None:
    h = host(travel_limit_counts=100)
    h.arm()
    assert h.run(4, moved=25).state == RUN
    assert h.run(1, moved=60).state == RUN
    assert h.run(1, moved=-60).state == RUN
    assert h.run(30).state == RUN
    assert h.run(1, moved=1).state == RUN
    assert h.run(1).fault_class == wire.OVER_TRAVEL
    assert h.fault()[2] == 101


def test_three_jumps(running: Host) -> None:
    assert running.run(1, moved=132 + 1).state == RUN
    assert running.run(50, moved=32).state == RUN
    assert running.run(1, moved=-8000).state == RUN
    sample = running.run(1, moved=4000)
    assert (sample.state, sample.fault_class) == (FAULTED, 7)
    assert running.fault() == (wire.ENCODER_JUMP, sample.tick, 4000)
