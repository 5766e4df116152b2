"""Interfaces of socketcan, where there are none: what the backend makes of what python-can makes of them."""

from __future__ import annotations

import errno
import os
import socket
from typing import TYPE_CHECKING

import can
import pytest

from dcmp_hil.config.backends import Can
from dcmp_hil.device.links.can import CanLink
from dcmp_hil.errors import LinkError, OpenError
from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Step = Exception | can.Message | None

DOWN = can.CanOperationError("Error receiving: Network is down", errno.ENETDOWN)
GONE = can.CanOperationError("Error receiving: No such device", errno.ENODEV)
NOT_ACKNOWLEDGED, BUS_OFF = 0x20, 0x40


def error_frame(kind: int) -> can.Message:
    return can.Message(arbitration_id=kind, is_error_frame=True, is_extended_id=False, dlc=8)


class Interface:
    """Acts through a script, the last step for ever; a descriptor is always ready."""

    def __init__(self, *script: Step) -> None:
        self._script = list(script)
        self._ends = os.pipe()
        os.write(self._ends[1], b"!")
        self.looks = 0
        self.shut = False

    def fileno(self) -> int:
        return self._ends[0]

    def recv(self, timeout: float) -> can.Message | None:
        assert timeout == 0.0
        self.looks += 1
        step = self._script.pop(0) if len(self._script) > 1 else self._script[0]
        if isinstance(step, Exception):
            raise step
        return step

    def send(self, _: can.Message, timeout: float) -> None:
        self.recv(timeout)

    def shutdown(self) -> None:
        self.shut = True
        for end in self._ends:
            os.close(end)


@pytest.fixture
def link(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., tuple[CanLink, Interface]]]:
    made: list[CanLink] = []

    def make(*script: Step, channel: str = "can0") -> tuple[CanLink, Interface]:
        interface = Interface(*script)
        monkeypatch.setattr(can, "Bus", lambda **_: interface)
        monkeypatch.setattr(socket, "if_nametoindex", lambda _: 1)
        made.append(CanLink(Can(kind="can", interface="socketcan", channel=channel), MonotonicClock()))
        return made[-1], interface

    yield make
    for one in made:
        one.close()


def test_interface_that_is_not_there_is_refused_before_python_can_sees_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(can, "Bus", lambda **_: pytest.fail("it was opened"))
    with pytest.raises(OpenError, match=r"socketcan nowhere0: there is no such interface. `ip link` lists"):
        CanLink(Can(kind="can", interface="socketcan", channel="nowhere0"), MonotonicClock()).open()


@pytest.mark.parametrize(
    ("channel", "command"),
    [
        ("can1", "sudo ip link set can1 up type can bitrate 1000000."),
        ("vcan0", "sudo ip link set vcan0 up."),
        ("slcan0", "sudo ip link set slcan0 up."),
    ],
)
def test_interface_that_is_down_is_refused_with_its_command(
    channel: str, command: str, link: Callable[..., tuple[CanLink, Interface]]
) -> None:
    made, interface = link(DOWN, channel=channel)
    with pytest.raises(OpenError) as caught:
        made.open()
    assert str(caught.value) == f"socketcan {channel}: the interface is down. Bring it up: {command}"
    assert interface.shut


def test_interface_that_fails_at_the_first_look_is_closed_again(
    link: Callable[..., tuple[CanLink, Interface]],
) -> None:
    made, interface = link(GONE)
    with pytest.raises(LinkError, match="No such device"):
        made.open()
    assert interface.shut


@pytest.mark.parametrize("act", [lambda link: link.receive(0.0), lambda link: link.send((1, b""))])
def test_interface_that_goes_down_is_named_with_its_command(
    act: Callable[[CanLink], object], link: Callable[..., tuple[CanLink, Interface]]
) -> None:
    made, _ = link(None, DOWN)
    made.open()
    with pytest.raises(LinkError, match=r"went down.* 0 V by itself.*sudo ip link set can0 up type can"):
        act(made)


def test_bus_off_is_an_error_with_its_remedy(link: Callable[..., tuple[CanLink, Interface]]) -> None:
    made, _ = link(None, error_frame(NOT_ACKNOWLEDGED), error_frame(BUS_OFF | NOT_ACKNOWLEDGED))
    made.open()
    with pytest.raises(LinkError, match=r"bus-off.*ip link set can0 down, then up"):
        made.receive(0.0)


def test_bus_full_of_errors_does_not_keep_the_loop(link: Callable[..., tuple[CanLink, Interface]]) -> None:
    made, interface = link(None, error_frame(NOT_ACKNOWLEDGED))
    made.open()
    assert made.receive(0.0) is None
    assert interface.looks < 100


def test_frame_behind_errors_is_found(link: Callable[..., tuple[CanLink, Interface]]) -> None:
    ours = can.Message(arbitration_id=0x20, data=b"\1", is_extended_id=False)
    made, _ = link(None, *[error_frame(NOT_ACKNOWLEDGED)] * 50, ours, None)
    made.open()
    assert made.receive(0.0) == (0x20, b"\1")
