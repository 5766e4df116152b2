"""What a user sees when the way to the device is wrong: one line, a remedy, exit code 3."""

from __future__ import annotations

import os
import threading
import tty
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import serial

from dcmp_hil.device.links import serial as serial_link
from sim_backend.board.board import Board
from tests.contract.ports.pty import PtyPort
from tests.contract.pump import Pump
from tests.helpers import bench

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]


@contextmanager
def device(*overrides: str, carrier: str = "cobs") -> Iterator[Pump]:
    """Put a board behind a pseudo terminal; the path is that of its port."""
    pump = Pump(Board(bench(*overrides), carrier=carrier), PtyPort())
    pump.start()
    try:
        yield pump
    finally:
        pump.close()


def path_of(pump: Pump) -> str:
    assert isinstance(pump.port, PtyPort)
    return pump.port.path


def start(cli: Cli, port: str, *more: str) -> Outcome:
    sets = [f"backend.port={port}", *more]
    options = [word for one in sets for word in ("--set", one)]
    return cli("run", "bench-serial", *options, "--duration", "0.1", "--no-record", "--viewer", "none")


def only_line(outcome: Outcome) -> str:
    """Return the one line that says what is wrong."""
    lines = [line for line in outcome.err.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1, outcome.err
    assert "Traceback" not in outcome.err
    return lines[0]


def test_missing_port(cli: Cli) -> None:
    outcome = start(cli, "/dev/there-is-none")
    assert outcome.code == 3
    assert "no such port" in only_line(outcome)
    assert "dcmp-hil ports" in only_line(outcome)


def test_no_permission(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> int:
        raise serial.SerialException(13, "could not open port: Permission denied")  # as pyserial says it

    monkeypatch.setattr(serial_link, "Port", refuse)  # root may open everything
    outcome = start(cli, "/dev/ttyS0")
    assert outcome.code == 3
    assert "dialout" in only_line(outcome)


def test_no_serial_port_at_all(cli: Cli) -> None:
    outcome = start(cli, "/dev/null")
    assert outcome.code == 3
    assert "no serial port" in only_line(outcome)


def test_serial_number_that_no_adapter_has(cli: Cli) -> None:
    outcome = start(cli, "A10KZP45")
    assert outcome.code == 3
    assert "serial number" in only_line(outcome)


def test_busy_port(cli: Cli) -> None:
    with device() as pump, serial.Serial(path_of(pump), exclusive=True):
        outcome = start(cli, path_of(pump))
    assert outcome.code == 3
    assert "busy" in only_line(outcome)


def test_no_device_answers(cli: Cli) -> None:
    master, slave = os.openpty()
    outcome = start(cli, os.ttyname(slave))
    os.close(master)
    os.close(slave)
    assert outcome.code == 3
    assert "nothing arrives" in only_line(outcome)


def test_wrong_baud_shows_as_damaged_frames(cli: Cli) -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    ending = threading.Event()

    def babble() -> None:  # what a line at another rate looks like
        while not ending.wait(0.01):
            os.write(master, bytes(range(1, 40)) + b"\0")

    thread = threading.Thread(target=babble)
    thread.start()
    try:
        outcome = start(cli, os.ttyname(slave))
    finally:
        ending.set()
        thread.join()
        os.close(master)
        os.close(slave)
    assert outcome.code == 3
    assert "baud" in only_line(outcome)


def test_wrong_firmware(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("handshake", "open_errors"):
        monkeypatch.setattr(f"dcmp_hil.device.{room}.PROTOCOL_HASH", 0x0BADCAFE)
    with device() as pump:
        outcome = start(cli, path_of(pump))
        assert not pump.board.enable
    assert outcome.code == 3
    assert "0badcafe" in only_line(outcome)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("encoder.counts_per_rev=2000", "the rig says 2000, the device 4096"),
        ("loop.rate_hz=500", "the rig says 500, the device 1000"),
        ("amplifier.voltage_limit_V=12", "the device allows 10"),
    ],
)
def test_device_that_is_not_what_the_rig_says(cli: Cli, override: str, words: str) -> None:
    with device() as pump:
        outcome = start(cli, path_of(pump), override)
        assert not pump.board.enable
    assert outcome.code == 2
    assert words in only_line(outcome)


def test_other_node(cli: Cli) -> None:
    with device() as pump:
        outcome = start(cli, path_of(pump), "backend.node=5")
    assert outcome.code == 3
    assert "none from node 5" in only_line(outcome)


def test_interface_that_python_can_does_not_have(cli: Cli) -> None:
    outcome = cli(
        "run", "bench-can", "--set", "backend.interface=socketcam", "--no-record", "--viewer", "none"
    )
    assert outcome.code == 2
    assert "socketcan" in only_line(outcome)


def test_can_channel_that_is_not_there(cli: Cli) -> None:
    outcome = cli("run", "bench-can", "--set", "backend.channel=can77", "--no-record", "--viewer", "none")
    assert outcome.code == 3
    assert "ip link" in only_line(outcome)


@pytest.mark.parametrize("interface", ["serial", "robotell", "seeedstudio"])
def test_interface_that_may_wait_for_ever_is_refused(cli: Cli, interface: str) -> None:
    overrides = ("--set", f"backend.interface={interface}", "--set", "backend.channel=/dev/null")
    outcome = cli("run", "bench-can", *overrides, "--no-record", "--viewer", "none")
    assert outcome.code == 2
    assert "slcan" in only_line(outcome)


@pytest.mark.parametrize("interface", ["kvaser", "pcan", "vector", "gs_usb", "ixxat"])
def test_interface_without_its_driver_is_one_line(cli: Cli, interface: str) -> None:
    overrides = ("--set", f"backend.interface={interface}", "--set", 'backend.channel="0"')
    outcome = cli("run", "bench-can", *overrides, "--no-record", "--viewer", "none")
    assert outcome.code == 3
    assert "ip link" not in only_line(outcome)


def test_networked_interface_is_refused(cli: Cli) -> None:
    outcome = cli(
        "run", "bench-can", "--set", "backend.interface=udp_multicast", "--no-record", "--viewer", "none"
    )
    assert outcome.code == 2
    assert "network" in only_line(outcome)


def test_run_that_never_began_leaves_nothing_behind(cli: Cli) -> None:
    port = "backend.port=/dev/there-is-none"
    outcome = cli("run", "bench-serial", "--set", port, "--viewer", "none", "--json", "-")
    assert outcome.code == 3
    assert outcome.out == ""
    assert not Path("runs").exists()
