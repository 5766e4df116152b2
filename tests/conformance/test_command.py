"""`dcmp-hil conform` of an installed wheel, against devices behind pseudo terminals."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.conformance.check import Verdict
from dcmp_hil.conformance.client import Client
from dcmp_hil.conformance.opening import open_line
from dcmp_hil.conformance.registry import CHECKS
from dcmp_hil.conformance.runner import run_checks
from dcmp_hil.platform.clock import MonotonicClock
from sim_backend.board.virtual_device import VirtualDevice
from tests.conformance.seeded import SEEDS
from tests.contract.ports.pty import PtyPort
from tests.contract.ports.virtual_bus import VirtualBus
from tests.contract.pump import Pump
from tests.contract.reference_device import ReferenceDevice
from tests.firmware.core_library import compiler
from tests.helpers import bench
from tests.installed import environment, started

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from tests.installed import Finished

    Script = Callable[..., Finished]

TIMEOUT_S = 120.0  # s, of one process: these machines are shared
WARNING = "warning: With --arm the motor is switched on"


@contextmanager
def device_command(installed: Path, folder: Path, link: str) -> Iterator[str]:
    """Run `dcmp-hil device`; give its port."""
    compiler()
    with started(installed, folder, "device", "--link", link) as process:
        assert process.stdout is not None
        yield process.stdout.readline().strip()


@contextmanager
def virtual_device() -> Iterator[VirtualDevice]:
    """Run a device whose output can be looked at."""
    compiler()
    with VirtualDevice(bench(), clock=MonotonicClock()) as device:
        device.start()
        yield device


def wait_for(holds: Callable[[], bool]) -> None:
    until = time.monotonic() + TIMEOUT_S
    while not holds():
        assert time.monotonic() < until
        time.sleep(0.001)


@pytest.mark.parametrize("link", ["cobs", "slcan"])
def test_the_virtual_device_passes(script: Script, installed: Path, tmp_path: Path, link: str) -> None:
    with device_command(installed, tmp_path, link) as port:
        done = script("conform", port, "--arm", "--yes", "--json", "conform.json", timeout=TIMEOUT_S)
    report = json.loads((tmp_path / "conform.json").read_text("utf-8"))
    assert {one["name"]: one["findings"] for one in report["checks"] if one["verdict"] == "failed"} == {}
    assert done.code == 0
    assert done.err.startswith(WARNING)
    assert done.err.count("\n") == 1
    assert (report["link"], report["armed"], report["ended_by"]) == (link, True, "finished")
    assert [one["name"] for one in report["checks"]] == [check.name for check in CHECKS]
    judged = {one["name"] for one in report["checks"] if one["verdict"] in {"passed", "other carrier"}}
    assert {check.name for check in CHECKS if not (check.timed or check.needs_arm)} <= judged
    late = [one["findings"][0] for one in report["checks"] if one["name"] not in judged]
    assert all("too late to answer" in reason for reason in late)  # a busy computer says so
    assert sorted(path.name for path in tmp_path.iterdir()) == ["conform.json"]


def test_without_arm_nothing_is_armed(script: Script, tmp_path: Path) -> None:
    with virtual_device() as device:
        done = script("conform", device.port, "--json", "-", timeout=TIMEOUT_S)
        assert not any(output.enable or output.voltage_mV for output in tuple(device.log))
    report = json.loads(done.out)
    assert done.code == 0, done.err
    assert report["counts"]["needs --arm"] == sum(check.needs_arm for check in CHECKS)
    assert report["counts"]["failed"] == 0
    assert done.err.splitlines()[-1].endswith("needs --arm")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_the_device_is_off_however_it_ends(installed: Path, tmp_path: Path, number: signal.Signals) -> None:
    with virtual_device() as device:
        arguments = ("conform", device.port, "--arm", "--yes", "--only", "corrupt-link", "--only", "voltage")
        with started(installed, tmp_path, *arguments) as process:
            wait_for(lambda: device.output.voltage_mV != 0)
            process.send_signal(number)
            out, err = process.communicate(timeout=TIMEOUT_S)
            wait_for(lambda: not device.output.enable and device.output.voltage_mV == 0)
            ticks = device.tick_count
            wait_for(lambda: device.tick_count > ticks + 100)
            assert not any(output.enable for output in list(device.log)[-50:])
    assert process.returncode == {signal.SIGINT: 130, signal.SIGKILL: -9}[number]
    if number != signal.SIGKILL:
        assert out.endswith("ended before the last\n")
        assert err.startswith(WARNING)
        assert err.count("\n") == 1


@contextmanager
def faulty(error: str) -> Iterator[str]:
    """Run a device with an error in a thread, a millisecond a tick; give its port."""
    make, carrier, _ = SEEDS[error]
    device, port, ending = make(carrier=carrier), PtyPort(), threading.Event()

    def tick() -> None:
        due = time.monotonic()
        while not ending.is_set():
            device.tick(0)
            due += 1e-3
            while (left := due - time.monotonic()) > 0:
                port.exchange(device, left)  # type: ignore[arg-type]
            port.exchange(device, 0.0)  # type: ignore[arg-type]

    thread = threading.Thread(target=tick, daemon=True)
    thread.start()
    try:
        yield port.path
    finally:
        ending.set()
        thread.join(TIMEOUT_S)
        port.close()


def test_an_error_of_a_device_is_named(script: Script) -> None:
    error = "crc16 is not checked"
    *_, name = SEEDS[error]
    with faulty(error) as port:
        done = script("conform", port, "--only", name, "--only", "identity", "--json", "-", timeout=TIMEOUT_S)
    report = json.loads(done.out)
    assert done.code == 1, done.err
    assert {one["name"]: one["verdict"] for one in report["checks"]} == {name: "failed", "identity": "passed"}
    assert report["checks"][0]["findings"][0] in done.err


def test_it_asks_before_anything_moves(script: Script) -> None:
    with virtual_device() as device:
        done = script("conform", device.port, "--arm")
        assert device.output.owner == 0
    assert (done.code, done.out) == (2, "")
    assert done.err.splitlines()[1:] == [
        "error: --arm: there is no terminal to confirm at. Add --yes if the motor may move."
    ]


def test_no_device_is_an_error_with_a_remedy(script: Script) -> None:
    master, slave = os.openpty()
    try:
        done = script("conform", os.ttyname(slave))
    finally:
        os.close(master)
        os.close(slave)
    assert (done.code, done.out) == (3, "")
    assert done.err.startswith("error: /dev/pts/")
    assert "nothing came within 2 s. Look at --baud" in done.err
    assert done.err.count("\n") == 1


def test_a_check_that_does_not_exist_is_refused(script: Script) -> None:
    done = script("conform", "/dev/pts/0", "--only", "nothing")
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        "error: --only nothing: there is no such check. `dcmp-hil conform --list` names them all.\n"
    )


def test_the_checks_are_listed(script: Script) -> None:
    done = script("conform", "--list")
    assert (done.code, done.err) == (0, "")
    assert [line.split()[0] for line in done.out.splitlines()] == [check.name for check in CHECKS]


class Patient(ReferenceDevice):
    """A device whose encoder stands still: what a pump ticks."""

    def tick(self) -> None:  # type: ignore[override]
        super().tick(0)


def test_a_can_bus_is_a_carrier_too() -> None:
    far = VirtualBus("conform")
    pump = Pump(Patient(carrier="can"), far)  # type: ignore[arg-type]
    pump.start()
    try:
        line = open_line(
            "conform", "can", interface="virtual", baud=1, bitrate=1_000_000, node=0, clock=MonotonicClock()
        )
        chosen = [
            check
            for check in CHECKS
            if check.name in {"identity", "ownership", "parameters-range", "answers"}
        ]
        outcomes = list(run_checks(Client(line, MonotonicClock()), chosen, armed=False, clear=False))
        line.close()
    finally:
        pump.close()
    assert {one.check.name: one.findings for one in outcomes if one.verdict != Verdict.PASSED} == {}
    assert len(outcomes) == 4


@pytest.mark.parametrize(("answer", "code"), [("n", 2), ("y", 0)])
def test_a_person_is_asked(installed: Path, tmp_path: Path, answer: str, code: int) -> None:
    master, slave = os.openpty()
    try:
        with virtual_device() as device:
            os.write(master, f"{answer}\n".encode())
            done = subprocess.run(
                [str(installed), "conform", device.port, "--arm", "--only", "arming", "--link", "cobs"],
                cwd=tmp_path,
                env=environment(),
                stdin=slave,
                capture_output=True,
                text=True,
                timeout=TIMEOUT_S,
                check=False,
            )
            ran = any(output.enable for output in tuple(device.log))
    finally:
        os.close(master)
        os.close(slave)
    assert (done.returncode, ran) == (code, answer == "y")
    assert "May the motor move? [y/N] " in done.stderr
    assert done.stdout == ("passed      arming (section 7)\n1 passed\n" if answer == "y" else "")
