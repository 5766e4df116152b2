"""`dcmp-hil ports`, and what it shares with `monitor`, at boards behind pseudo terminals and on buses."""

from __future__ import annotations

import itertools
import os
import shlex
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import can
import pytest

from dcmp_hil.config import load_rig
from dcmp_hil.config.backends import Can, Serial
from dcmp_hil.errors import OpenError
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack
from sim_backend.board.board import Board
from tests.cli.ports import SAMPLE
from tests.cli.test_wire_errors import device, only_line, path_of
from tests.contract.benches import on_bench
from tests.contract.driving import drive
from tests.contract.ports.virtual_bus import VirtualBus
from tests.contract.pump import Pump
from tests.device.line import line
from tests.helpers import bench

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]

pytestmark = pytest.mark.usefixtures("needs_compiler")


@pytest.fixture(autouse=True)
def _no_ports_of_this_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the computer's own serial ports out: each is listened to for as long as `--wait` says, twice."""
    monkeypatch.setattr("serial.tools.list_ports.comports", list)


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_ports_finds_the_device_on_either_carrier_and_says_how_to_run_it(cli: Cli, carrier: str) -> None:
    with device(carrier=carrier) as pump:
        path = path_of(pump)
        outcome = cli("ports", path)
        assert not pump.board.owner  # it asked, and owns nothing
    assert outcome.code == 0
    assert "node 0, firmware 0.1, protocol" in outcome.out
    assert "IDLE" in outcome.out
    key = "backend.port" if carrier == "cobs" else "backend.channel"
    assert f"--set {key}={path}" in outcome.out


def test_ports_says_what_else_it_met(cli: Cli) -> None:
    master, slave = os.openpty()
    path = os.ttyname(slave)
    outcome = cli("ports", path, "/dev/there-is-none")
    os.close(master)
    os.close(slave)
    assert outcome.code == 0
    assert "nothing heard" in outcome.out
    assert "no such port" in outcome.out


def test_ports_says_who_has_a_busy_port(cli: Cli) -> None:
    with device() as pump:
        path = path_of(pump)
        script = (
            f"import serial, sys; port = serial.Serial({path!r}, exclusive=True); "
            "print(1, flush=True); sys.stdin.read()"
        )
        other = subprocess.Popen(
            [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert other.stdout is not None
        other.stdout.readline()
        outcome = cli("ports", path)
        busy = cli("monitor", "bench-serial", "--set", f"backend.port={path}", "--duration", "0.2")
        other.communicate(timeout=10)
    assert f"(process {other.pid}) has it" in outcome.out
    assert busy.code == 3
    assert f"(process {other.pid}) has it" in only_line(busy)


def test_ports_sees_a_device_in_use_on_a_bus_and_leaves_it_alone(
    monkeypatch: pytest.MonkeyPatch, cli: Cli
) -> None:
    with on_bench("can virtual") as found:
        channel = found.rig.backend.channel  # type: ignore[union-attr]
        monkeypatch.setattr("dcmp_hil.device.discovery._can_channels", lambda: [("virtual", channel)])
        with found.device() as backend:
            drive(backend, 1.0, 20)
            found.hurry()
            outcome = cli("ports")
    assert "in use by a host" in outcome.out
    assert f"interface=virtual --set backend.channel={channel}" in outcome.out


def test_ports_says_what_to_do_where_there_is_nothing(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("can.detect_available_configs", lambda **_: [])
    outcome = cli("ports")
    assert outcome.code == 0
    assert "dcmp-hil device" in outcome.err


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_ports_finds_the_device_after_a_run(cli: Cli, carrier: str) -> None:
    with on_bench(f"{carrier} pty") as found:
        assert found.pump is not None
        with found.device() as backend:
            drive(backend, 1.0, 5)
        found.hurry()
        outcome = cli("ports", path_of(found.pump))
    assert "node 0, firmware 0.1" in outcome.out


_FOREIGN = {
    "silence": b"",
    "text": b"$GPGGA,123519,4807.038,N*47\r\n",
    "one sample again and again": cobs.encode(pack(SAMPLE)),
    "one slcan sample again and again": slcan.encode(pack(SAMPLE)),
}


@pytest.mark.parametrize("said", list(_FOREIGN.values()), ids=list(_FOREIGN))
def test_ports_writes_nothing_where_no_device_is_heard(cli: Cli, said: bytes) -> None:
    with line(said) as far:
        outcome = cli("ports", far.path)
        assert far.heard() == b""
    assert outcome.code == 0
    assert "--set" not in outcome.out


def commands(outcome: Outcome) -> list[Rig]:
    """Return the rig that each printed command runs."""
    rigs = []
    for printed in outcome.out.splitlines():
        words = shlex.split(printed) if "dcmp-hil run" in printed else []
        if words:
            assert words[:2] == ["dcmp-hil", "run"]
            rigs.append(load_rig("bench-1khz", words[3::2]))
    return rigs


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_ports_names_what_is_not_the_default(cli: Cli, carrier: str) -> None:
    with device(carrier=carrier) as pump:
        (usual,) = commands(cli("ports", path_of(pump)))
    assert "node" not in usual.backend.model_fields_set
    node = ("backend.kind=sim-board", "backend.node=3")
    with device(*node, carrier=carrier) as pump:
        outcome = cli("ports", path_of(pump), "--baud", "500000", "--bitrate", "250000")
    (rig,) = commands(outcome)
    found = rig.backend
    assert "node 3, firmware" in outcome.out
    if carrier == "cobs":
        assert found == Serial(kind="serial", port=path_of(pump), baud=500_000, node=3)
    else:
        assert found == Can(
            kind="can", interface="slcan", channel=path_of(pump), baud=500_000, bitrate=250_000, node=3
        )


def test_ports_lists_every_device_of_a_bus(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    channel = "ports-two-devices"
    monkeypatch.setattr("dcmp_hil.device.discovery._can_channels", lambda: [("virtual", channel)])
    pumps = []
    for node in (9, 2):
        rig = bench("backend.kind=sim-board", f"backend.node={node}")
        pumps.append(Pump(Board(rig, carrier="can"), VirtualBus(channel)))
    for pump in pumps:
        pump.start()
    try:
        outcome = cli("ports")
    finally:
        for pump in pumps:
            pump.close()
    nodes = [rig.backend.node for rig in commands(outcome) if isinstance(rig.backend, Can)]
    assert nodes == [2, 9], outcome.out
    assert outcome.out.count("firmware 0.1") == 2


def test_ports_and_monitor_notice_two_devices_with_one_node(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    channel = "ports-one-node-twice"
    monkeypatch.setattr("dcmp_hil.device.discovery._can_channels", lambda: [("virtual", channel)])
    ending = threading.Event()

    def two_devices() -> None:
        with can.Bus(channel=channel, interface="virtual", ignore_config=True) as bus:
            for tick in itertools.count():
                for other in (0, 90):
                    number, data = pack(SAMPLE._replace(tick=(tick + other) % 256), 5)
                    bus.send(can.Message(arbitration_id=number, data=data, is_extended_id=False))
                if ending.wait(2e-3):
                    return

    thread = threading.Thread(target=two_devices)
    thread.start()
    way = ("--set", "backend.interface=virtual", "--set", f"backend.channel={channel}")
    try:
        listed = cli("ports")
        watched = cli("monitor", "bench-can", *way, "--duration", "2")
    finally:
        ending.set()
        thread.join()
    assert "node 5, TWO devices" in listed.out
    assert watched.err.count("two devices send as node 5") == 1


def test_ports_waits_for_a_board_that_boots(cli: Cli) -> None:
    with device() as pump:
        pump.silent.set()
        threading.Timer(1.0, pump.silent.clear).start()
        outcome = cli("ports", path_of(pump), "--wait", "20")
    assert "node 0, firmware 0.1" in outcome.out


def test_ports_goes_on_where_a_driver_fails_in_looking(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def detect(interfaces: str) -> list[dict[str, str]]:
        if interfaces == "gs_usb":
            raise ValueError("no backend available")
        return [{"interface": "virtual", "channel": "vcan-test"}] if interfaces == "pcan" else []

    monkeypatch.setattr("can.detect_available_configs", detect)
    outcome = cli("ports")
    assert outcome.code == 0
    assert "virtual vcan-test" in outcome.out


@pytest.mark.parametrize("arguments", [["--baud", "5"], ["--bitrate", "5"], [""], ["/dev/" + 200 * "x"]])
def test_ports_refuses_what_cannot_be(cli: Cli, arguments: list[str]) -> None:
    outcome = cli("ports", *arguments)
    assert outcome.code == 2
    assert "Traceback" not in outcome.err


def test_ports_and_monitor_close_what_could_not_be_opened(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[str] = []

    class Broken:
        name, corrupt = "broken", 0

        def open(self) -> None:
            raise OpenError("broken: cannot be opened. Mend it.")

        def close(self) -> None:
            closed.append(self.name)

    for room in ("dcmp_hil.device.discovery", "dcmp_hil.cli.execute_monitor"):
        monkeypatch.setattr(f"{room}.make_listening_link", lambda *_: Broken())
    assert cli("ports", "/dev/ttyX").code == 0
    assert closed
    closed.clear()
    assert cli("monitor").code == 3
    assert closed
