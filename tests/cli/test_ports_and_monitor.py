"""`dcmp-hil ports` and `monitor`, against boards behind pseudo terminals."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.backends import open_backend
from tests.cli.test_wire_errors import device, only_line, path_of
from tests.contract.benches import PatientClock, on_bench
from tests.contract.test_contract import drive
from tests.firmware.core_library import compiler

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]


@pytest.fixture(scope="module", autouse=True)
def needs_compiler() -> None:
    compiler()


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
        monkeypatch.setattr("dcmp_hil.backends.discovery._can_channels", lambda: [("virtual", channel)])
        with found.device() as backend:
            drive(backend, 1.0, 20)
            found.hurry()
            outcome = cli("ports")
    assert "in use by a host" in outcome.out
    assert f"interface=virtual --set backend.channel={channel}" in outcome.out


def test_ports_says_what_to_do_where_there_is_nothing(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    monkeypatch.setattr("can.detect_available_configs", lambda **_: [])
    outcome = cli("ports")
    assert outcome.code == 0
    assert "dcmp-hil device" in outcome.err


def test_monitor_shows_samples_ten_times_a_second_or_all(cli: Cli) -> None:
    with device() as pump:
        where = ("monitor", "bench-serial", "--set", f"backend.port={path_of(pump)}", "--duration", "0.5")
        brief, everything = cli(*where), cli(*where, "--all")
        assert not pump.board.owner
    few, many = (outcome.out.count("Sample") for outcome in (brief, everything))
    assert 2 <= few <= 6 < many
    assert "IDLE" in brief.out
    assert "0 damaged" in brief.err


def test_monitor_decodes_both_sides_of_a_bus(cli: Cli) -> None:
    with on_bench("can virtual") as found:
        channel = found.rig.backend.channel  # type: ignore[union-attr]

        ending = threading.Event()

        def host() -> None:
            while not ending.is_set():
                with open_backend(found.rig, PatientClock()) as backend:
                    drive(backend, 1.0, 30)

        thread = threading.Thread(target=host)
        thread.start()
        try:
            outcome = cli(
                "monitor", "bench-can", "--all", "--duration", "1.0",
                "--set", "backend.interface=virtual", "--set", f"backend.channel={channel}",
            )  # fmt: skip
        finally:
            ending.set()
            thread.join(10.0)
    for word in (
        "Sample",
        "Drive",
        "Hello",
        "Identity",
        "ParameterValue",
        "PERIOD_US = 1000",
        "RUN",
        "ttl_ms 20",
    ):
        assert word in outcome.out


def test_monitor_of_a_rig_without_a_wire_says_what_it_can_watch(cli: Cli) -> None:
    outcome = cli("monitor", "bench-1khz")
    assert outcome.code == 2
    assert "no wire to listen to" in only_line(outcome)
