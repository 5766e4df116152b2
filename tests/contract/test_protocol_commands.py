"""What docs/protocol.md says of arming, commands and their age, asked of two devices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.contract import reference_wire as wire
from tests.contract.protocol_host import OTHER_SESSION, Host
from tests.contract.reference_wire import ARMING, IDLE, RUN

if TYPE_CHECKING:
    from collections.abc import Callable


def test_ten_drives_arm_the_device(ready: Host) -> None:
    for _ in range(9):
        ready.drive(arm=1)
        assert ready.tick().state == ARMING
        assert not ready.device.enable
    ready.drive(arm=1)
    assert ready.tick().state == RUN
    assert ready.device.enable


def test_arming_must_be_unbroken(ready: Host) -> None:
    ready.drive(5, arm=1)
    assert ready.tick().state == IDLE
    for broken in ({"arm": 0}, {"clear": 1}, {"release": 1}, {"arm": 1, "voltage_mV": 1}):
        ready.drive(arm=1)
        assert ready.tick().state == ARMING
        ready.drive(**broken)
        assert ready.tick().state == IDLE
        assert ready.hello() == "o"
    for gap, state in ((3, ARMING), (4, IDLE)):
        ready.drive(arm=1)
        for _ in range(gap):
            ready.tick()
        ready.drive(arm=1)
        assert ready.tick().state == state


def test_a_command_from_sample_k_acts_from_k_plus_1_and_is_seen_in_k_plus_2(running: Host) -> None:
    running.drive(1500, arm=1)
    assert running.device.applied_mV == 0
    sample = running.tick()
    assert (sample.voltage_mV, sample.missed, sample.limited) == (0, False, False)
    assert running.device.applied_mV == 1500
    sample = running.tick()
    assert (sample.voltage_mV, sample.missed) == (1500, True)
    assert running.device.applied_mV == 1500  # held
    running.drive(-700, arm=1, back=1)
    running.drive(-800, arm=1)
    running.tick()
    assert running.device.applied_mV == -800  # the newest of several


@pytest.mark.parametrize(("period_us", "reach"), [(1000, 3), (2000, 2), (2500, 2), (3000, 1), (4000, 1)])
def test_age(host: Callable[..., Host], period_us: int, reach: int) -> None:
    h = host(period_us=period_us, first_tick=8188)
    for _ in range(10):  # over the end of seq
        h.tick()
    h.hello()
    for back in (reach + 1, 256, -1, 4096):
        h.drive(back=back)
    assert h.tick().missed
    h.drive(back=reach)
    assert not h.tick().missed
    assert h.health()["sequence_gaps"] == 4


def test_age_goes_by_the_counter_whether_samples_came_or_not(ready: Host) -> None:
    for _ in range(5):  # the host hears nothing of these
        ready.device.tick(0)
        (ready.device.transmit_frames if ready.carrier == "can" else ready.device.transmit)()
    ready.drive(arm=1)  # answers the newest SAMPLE that it heard
    ready.ticks += 5
    assert ready.tick().missed
    assert ready.get(wire.TICK) == (wire.OK, ready.ticks)
    ready.drive(arm=1)
    assert not ready.tick().missed
    assert ready.health()["sequence_gaps"] >= 1


def test_order(ready: Host) -> None:
    for _ in range(5):
        ready.tick()
    ready.drive(back=1)
    assert not ready.tick().missed
    ready.drive(back=2)  # the same again
    ready.drive(back=3)
    assert ready.tick().missed
    assert ready.health()["sequence_gaps"] == 2


def test_what_is_not_the_owners_or_not_in_range_feeds_nothing(ready: Host) -> None:
    for ttl_ms in (0, 4, 51, 255):
        ready.drive(arm=1, ttl_ms=ttl_ms)
    ready.drive(arm=1, clear=1)
    ready.drive(arm=1, release=1)
    ready.drive(clear=1, release=1)
    ready.drive(arm=1, session=OTHER_SESSION)
    ready.drive(arm=1, session=0)
    assert ready.tick().missed
    assert ready.tick().state == IDLE
    assert ready.health()["sequence_gaps"] == 0


def test_what_is_not_for_this_device_is_no_error(ready: Host) -> None:
    ready.send(wire.STOP, b"\0", node=1)
    ready.send(wire.STOP, b"\0", node=1, spoil=1)
    ready.send(wire.STOP, b"\0\0")
    ready.send(wire.DRIVE, bytes(6), spoil=1)
    ready.send(0x7E, bytes(7))
    assert ready.tick().state == IDLE
    ready.send(wire.STOP, b"\0", spoil=1)
    assert ready.health()["crc_errors"] == 1


def test_voltage_is_clamped_and_slewed(host: Callable[..., Host]) -> None:
    h = host(voltage_limit_mV=5000, slew_mV_per_ms=2000)
    h.arm()
    h.drive(-32768, arm=1)
    assert h.tick().limited
    assert h.device.applied_mV == -2000
    assert h.tick().voltage_mV == -2000  # goes on without a DRIVE
    assert h.device.applied_mV == -4000
    assert h.tick().limited
    assert h.device.applied_mV == -5000
    h.drive(-4000, arm=1)
    assert not h.tick().limited
    assert h.device.applied_mV == -4000
    h.drive(arm=0)
    assert h.device.applied_mV == 0  # at once


@pytest.mark.parametrize("word", [{"arm": 0}, {"clear": 1}, {"release": 1}])
def test_run_ends_at_once(running: Host, word: dict[str, int]) -> None:
    running.run(3, 3000)
    running.drive(3000, **word)
    assert (running.device.applied_mV, running.device.enable) == (0, False)
    sample = running.tick()
    assert (sample.state, sample.voltage_mV, sample.fault_class) == (IDLE, 0, 0)
    assert running.hello(OTHER_SESSION) == ("o" if "release" in word else "b")
