"""Links by themselves: what they write, what they leave open, what they say when they cannot be opened."""

from __future__ import annotations

import logging
import socket
from typing import TYPE_CHECKING, Any, NoReturn

import can
import pytest
import serial

from dcmp_hil.config.backends import Can
from dcmp_hil.device.links.can import CanLink
from dcmp_hil.device.links.serial import SerialLink
from dcmp_hil.errors import ConfigError, DcmpError, OpenError
from dcmp_hil.platform.clock import MonotonicClock
from tests.device.line import line

if TYPE_CHECKING:
    from dcmp_hil.device.links.base import Link

CARRIERS = pytest.mark.parametrize("carrier", ["cobs", "slcan"])
OPENING = {"cobs": b"\0", "slcan": b"\rC\rS8\rN\rO\r"}
CLOSING = {"cobs": b"", "slcan": b"C\r"}
MODULE = {"cobs": "links.serial", "slcan": "links.slcan"}


def link_to(path: str, carrier: str, *, listen_only: bool = False) -> Link:
    if carrier == "cobs":
        return SerialLink(path, 1_000_000, listen_only=listen_only)
    return can_link("slcan", path, listen_only=listen_only)


def can_link(interface: str, channel: str, *, listen_only: bool = False, **options: Any) -> CanLink:
    settings = Can(kind="can", interface=interface, channel=channel, options=options)
    return CanLink(settings, MonotonicClock(), listen_only=listen_only)


def raising(error: BaseException) -> Any:
    def refuse(*_: object, **__: object) -> NoReturn:
        raise error

    return refuse


def complaint(link: Link, kind: type[DcmpError]) -> str:
    with pytest.raises(kind) as caught:
        link.open()
    assert "\n" not in str(caught.value)
    return str(caught.value)


@CARRIERS
def test_link_that_takes_part_opens_and_closes_the_line(carrier: str) -> None:
    with line() as far:
        link = link_to(far.path, carrier)
        link.open()
        assert far.heard() == OPENING[carrier]
        link.close()
        assert far.heard() == OPENING[carrier] + CLOSING[carrier]


@CARRIERS
def test_link_that_only_listens_writes_what_is_sent_and_nothing_else(carrier: str) -> None:
    with line() as far:
        link = link_to(far.path, carrier, listen_only=True)
        link.open()
        assert link.receive(0.02) is None
        assert far.heard() == b""
        link.send((0x0C0, b"\1"))
        said = far.heard()
        assert said
        link.close()
        assert far.heard() == said


@CARRIERS
@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(5, "Input/output error")])
def test_open_that_fails_half_way_closes_the_port(
    carrier: str, error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    with line() as far:
        monkeypatch.setattr(f"dcmp_hil.device.{MODULE[carrier]}.write_now", raising(error))
        link = link_to(far.path, carrier)
        with pytest.raises((DcmpError, KeyboardInterrupt)) as caught:  # keeps alive what was left open
            link.open()
        serial.Serial(far.path, exclusive=True).close()
        del caught


def test_port_is_closed_when_its_setting_up_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    with line() as far:
        monkeypatch.setattr(serial.Serial, "set_low_latency_mode", raising(KeyboardInterrupt()))
        with pytest.raises(KeyboardInterrupt) as caught:
            link_to(far.path, "cobs").open()
        serial.Serial(far.path, exclusive=True).close()
        del caught


def test_bus_is_shut_down_when_its_opening_is_interrupted(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    shut: list[bool] = []

    class Bus(can.BusABC):
        def __init__(self, channel: str, **_: object) -> None:
            super().__init__(channel)

        fileno = raising(KeyboardInterrupt())

        def shutdown(self) -> None:
            super().shutdown()
            shut.append(True)

        def send(self, msg: can.Message, timeout: float | None = None) -> None: ...

    monkeypatch.setattr(can, "Bus", Bus)
    with caplog.at_level(logging.WARNING), pytest.raises(KeyboardInterrupt):
        can_link("virtual", "here").open()
    assert shut == [True]
    assert not caplog.records


def test_closed_slcan_link_still_knows_how_much_was_damaged() -> None:
    with line(b"t04\r") as far:
        link = link_to(far.path, "slcan")
        link.open()
        while not link.corrupt:
            link.receive(1.0)
        before = link.corrupt
        link.close()
        assert link.corrupt == before
        link.close()
        assert link.corrupt == before


def test_link_can_be_opened_again_after_it_was_closed() -> None:
    with line() as far:
        link = link_to(far.path, "cobs")
        for _ in range(2):
            link.open()
            assert link.receive(0.01) is None
            link.close()
            link.close()


def test_option_that_slcan_does_not_have_is_named() -> None:
    said = complaint(can_link("slcan", "/dev/there-is-none", ttyBaudrate=115200), ConfigError)
    assert "ttyBaudrate" in said


@pytest.mark.parametrize("interface", ["serial", "robotell", "seeedstudio"])
def test_interface_that_may_wait_for_ever_is_refused_before_it_is_opened(interface: str) -> None:
    with line() as far:
        said = complaint(can_link(interface, far.path), ConfigError)
        assert far.heard() == b""
    assert "slcan" in said
    assert 'backend.kind = "serial"' in said


@pytest.mark.parametrize(
    "error",
    [can.CanInterfaceNotImplementedError("no driver\nfor this."), ImportError("no module\nof that name")],
)
def test_missing_driver_is_named_as_such(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(can, "Bus", raising(error))
    said = complaint(can_link("pcan", "PCAN_USBBUS1"), OpenError)
    assert "driver is missing" in said


@pytest.mark.parametrize(
    "error", [NameError("name 'canOpen' is not defined"), RuntimeError("a\nb"), KeyError()]
)
@pytest.mark.parametrize(("interface", "remedy"), [("kvaser", "its driver"), ("socketcan", "ip link set")])
def test_any_error_of_a_driver_is_one_line_with_its_own_remedy(
    interface: str, remedy: str, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(can, "Bus", raising(error))
    monkeypatch.setattr(socket, "if_nametoindex", lambda _: 1)
    said = complaint(can_link(interface, "0"), OpenError)
    assert remedy in said
    assert ("ip link" in said) == (interface == "socketcan")


def test_error_frames_of_a_can_bus_count_as_damage() -> None:
    near = can_link("virtual", "errors")
    near.open()
    with can.Bus(channel="errors", interface="virtual", ignore_config=True) as far:
        for _ in range(3):
            far.send(can.Message(is_error_frame=True, is_extended_id=False))
        far.send(can.Message(arbitration_id=0x40, data=bytes(8), is_extended_id=False))
        assert near.receive(1.0) == (0x40, bytes(8))
    assert near.corrupt == 3
    near.close()
    assert near.corrupt == 3
