"""What docs/protocol.md says of samples, sessions and parameters, asked of two devices."""

from __future__ import annotations

import binascii
from typing import TYPE_CHECKING

import pytest

from tests.contract import reference_wire as wire
from tests.contract.protocol_host import HASH, OTHER_SESSION, OUR_SESSION, Host
from tests.contract.reference_wire import ARMING, IDLE, RUN

if TYPE_CHECKING:
    from collections.abc import Callable


def test_the_checks_of_the_page() -> None:
    assert wire.crc8(b"123456789") == 0xDF
    assert wire.crc16(b"123456789") == 0x29B1 == binascii.crc_hqx(b"123456789", 0xFFFF)


def test_one_sample_a_period_from_boot_on(host: Callable[..., Host]) -> None:
    h = host(first_tick=250, node=3)
    h.counts = -2
    assert h.tick() == (0xFFFFFE, 0, 250, IDLE, True, False, 0)
    for k in range(20):
        assert h.tick(1).position == (k - 1) % 2**24
    for _ in range(1000):
        h.tick()
    assert sum(number == wire.HEALTH for number, _ in h.seen) in {10, 11}


def test_hello_finds_an_owner(host: Callable[..., Host]) -> None:
    h = host()
    h.tick()
    assert h.hello(0) == ""
    assert h.hello(0, HASH ^ 1) == "m"
    assert h.hello(OUR_SESSION, HASH ^ 1) == "m"
    assert h.hello(OUR_SESSION) == "o"
    assert h.hello(OTHER_SESSION) == "b"
    assert h.hello(0) == "b"
    assert h.hello(OUR_SESSION) == "o"


def test_ownership_ends_by_silence_or_release(ready: Host) -> None:
    for _ in range(490):
        ready.tick()
    ready.drive(session=OTHER_SESSION)  # no owner's
    ready.drive(back=4)  # too old
    assert ready.hello(OTHER_SESSION) == "b"
    assert ready.put(wire.TICK, 1)[0] == wire.READ_ONLY  # counts all the same
    for _ in range(490):
        ready.tick()
    assert ready.hello(OTHER_SESSION) == "b"
    assert ready.hello(OUR_SESSION, HASH ^ 1) == "om"  # counts for nothing
    for _ in range(11):
        ready.tick()
    assert ready.hello(OTHER_SESSION) == "o"
    ready.drive(release=1, session=OTHER_SESSION)
    assert ready.hello(OUR_SESSION) == "o"


def test_parameters(host: Callable[..., Host]) -> None:
    h = host(first_tick=2**31 - 1, counts_per_rev=8192)
    h.tick()
    assert h.get(wire.TICK) == (wire.OK, 2**31 - 1)
    h.tick()
    assert h.get(wire.TICK) == (wire.OK, 0)
    assert h.get(wire.COUNTS_PER_REV) == (wire.OK, 8192)
    assert h.get(wire.PERIOD_US) == (wire.OK, 1000)
    assert h.get(wire.EDGE_STAMPS) == (wire.OK, 0)
    assert h.get(wire.TRAVEL_ORIGIN) == (wire.OK, -1)
    assert h.get(0) == h.get(17) == (wire.UNKNOWN, 0)
    assert h.get(wire.SUPPLY) == (wire.OK, 0)
    assert h.put(wire.VOLTAGE_LIMIT, 5000) == (wire.NOT_OWNER, 10_000)
    h.hello()
    assert h.put(99, 0, OTHER_SESSION) == (wire.UNKNOWN, 0)
    assert h.put(wire.PERIOD_US, 0, OTHER_SESSION) == (wire.READ_ONLY, 1000)
    assert h.put(wire.VOLTAGE_LIMIT, 10_001, OTHER_SESSION) == (wire.OUT_OF_RANGE, 10_000)
    for id_, built in ((wire.VOLTAGE_LIMIT, 10_000), (wire.SPEED_LIMIT, 32_768), (wire.TRAVEL_LIMIT, 16_384)):
        assert h.put(id_, 1) == (wire.OK, 1)
        assert h.put(id_, 0) == h.put(id_, -1) == h.put(id_, built + 1) == (wire.OUT_OF_RANGE, 1)
        assert h.put(id_, built) == (wire.OK, built)
    built = h.get(wire.WATCHDOG)[1]
    assert [h.put(wire.WATCHDOG, ms)[0] for ms in (4, 5, built, built + 1)] == [3, 0, 0, 3]
    assert h.put(wire.SLEW, 0) == (wire.OUT_OF_RANGE, 0)
    assert h.put(wire.SLEW, 70_000) == (wire.OK, 70_000)
    h.drive(arm=1)
    assert h.put(wire.SLEW, 1, OTHER_SESSION) == (wire.NOT_IDLE, 70_000)


@pytest.mark.parametrize("session", [OUR_SESSION, OTHER_SESSION])
def test_the_next_host_finds_the_device_as_it_was_built(ready: Host, session: int) -> None:
    watchdog_ms = ready.get(wire.WATCHDOG)[1]
    assert ready.put(wire.VOLTAGE_LIMIT, 2000) == (wire.OK, 2000)
    assert ready.put(wire.SLEW, 5) == (wire.OK, 5)
    assert ready.put(wire.WATCHDOG, 12) == (wire.OK, 12)
    assert ready.hello() == "o"  # the owner again: nothing changes
    assert ready.get(wire.VOLTAGE_LIMIT) == (wire.OK, 2000)
    ready.drive(release=1)
    assert ready.get(wire.SLEW) == (wire.OK, 0)  # it ends with the session
    assert ready.hello(session) == "o"
    assert ready.get(wire.VOLTAGE_LIMIT) == (wire.OK, 10_000)
    assert ready.get(wire.SLEW) == (wire.OK, 0)
    assert ready.get(wire.WATCHDOG) == (wire.OK, watchdog_ms)
    assert ready.get(wire.TICK)[1] == ready.ticks


@pytest.mark.parametrize("drives", [4, 10])
def test_a_hello_of_the_owner_again_changes_nothing(ready: Host, drives: int) -> None:
    for _ in range(drives):
        ready.drive(arm=1)
        assert ready.tick().state in {ARMING, RUN}
    before = ready.tick().state
    assert ready.hello() == ready.hello() == "o"
    ready.drive(arm=1, back=ready.ticks % 8192)  # far too old, as it was before
    ready.drive(900, arm=1) if before == RUN else ready.drive(arm=1)
    assert ready.tick().state == before
    assert ready.device.applied_mV == (900 if before == RUN else 0)
