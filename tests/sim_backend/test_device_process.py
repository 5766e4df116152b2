"""The process of the virtual device: its end, its errors, its pace, its port and its symlink."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from dcmp_hil.errors import ConfigError, LinkError, OpenError
from dcmp_hil.platform.clock import MonotonicClock, SimulatedClock
from sim_backend.board.virtual_device import VirtualDevice
from tests.helpers import bench
from tests.sim_backend.terminal import PATIENT_S, connected

pytestmark = pytest.mark.usefixtures("needs_compiler")


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


def test_process_is_gone_with_the_device() -> None:
    with VirtualDevice(bench(), clock=SimulatedClock()) as device:
        device.run_ticks(3)
        pid, port = device.pid, device.port
        assert is_running(pid)
        assert os.isatty(os.open(port, os.O_RDWR | os.O_NOCTTY))
    assert not is_running(pid)
    with pytest.raises(LinkError, match="not running"):
        device.run_ticks(1)


def test_process_that_hangs_is_ended_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim_backend.board.virtual_device._END_TIMEOUT_S", 0.1)
    with VirtualDevice(bench(), clock=SimulatedClock()) as device:
        pid = device.pid
        os.kill(pid, signal.SIGSTOP)
    assert not is_running(pid)


def test_process_that_ends_by_itself_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    with VirtualDevice(bench(), clock=SimulatedClock()) as device:
        os.kill(device.pid, signal.SIGKILL)
        with pytest.raises(LinkError, match="has ended"):
            device.run_ticks(10)
    monkeypatch.setattr("sim_backend.board.virtual_device._ANSWER_TIMEOUT_S", 0.05)
    with VirtualDevice(bench(), clock=SimulatedClock()) as device:
        os.kill(device.pid, signal.SIGSTOP)
        with pytest.raises(LinkError, match="does not answer"):
            device.run_ticks(1)
        os.kill(device.pid, signal.SIGCONT)


def test_thread_that_cannot_go_on_says_why() -> None:
    with VirtualDevice(bench()) as device:
        device.start()
        os.kill(device.pid, signal.SIGKILL)
        deadline_ns = MonotonicClock().now_ns() + int(1e9 * PATIENT_S)
        while device.error is None and MonotonicClock().now_ns() < deadline_ns:
            pass
        assert isinstance(device.error, LinkError)


def test_closed_port_costs_no_time_of_the_processor(device: VirtualDevice) -> None:
    with connected(device):
        device.run_ticks(1)
    assert not device.wait_for_change(0.5)
    fields = Path(f"/proc/{device.pid}/stat").read_text().rsplit(")", 1)[1].split()
    assert int(fields[11]) + int(fields[12]) < 0.2 * os.sysconf("SC_CLK_TCK")


def test_wall_clock_paces_it() -> None:
    clock = MonotonicClock()
    with VirtualDevice(bench(), clock=clock) as device:
        began_ns = clock.now_ns()
        device.run_ticks(101)
        assert clock.now_ns() - began_ns >= 100e6


def test_symlink_leads_to_the_port_while_there_is_one(tmp_path: Path) -> None:
    link = tmp_path / "port"
    link.symlink_to("/dev/pts/of-a-run-that-crashed")
    with VirtualDevice(bench(), symlink=link) as device:
        assert str(link.readlink()) == device.port
    assert not link.is_symlink()


def test_file_is_never_taken_for_a_symlink(tmp_path: Path) -> None:
    link = tmp_path / "port"
    link.write_text("mine")
    device = VirtualDevice(bench(), symlink=link)
    with pytest.raises(ConfigError, match="--symlink"):
        device.__enter__()
    assert link.read_text() == "mine"
    assert device.pid == 0


def test_program_that_does_not_start_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "program"
    monkeypatch.setattr("sim_backend.board.build.program", lambda: program)
    program.write_text("#!/bin/sh\necho no terminal left >&2; exit 3\n")
    with pytest.raises(OpenError, match="XDG_CACHE_HOME"):
        VirtualDevice(bench()).__enter__()
    program.chmod(0o755)
    with pytest.raises(OpenError, match="no terminal left"):
        VirtualDevice(bench()).__enter__()


def test_longest_time_between_two_ticks_is_known_from_any_instant_on() -> None:
    clock = SimulatedClock()
    with VirtualDevice(bench(), clock=clock) as device:
        device.run_ticks(3)
        assert device.longest_gap_us(clock.now_ns() - 2_000_000) == 1_000
        clock.sleep_until_ns(clock.now_ns() + 25_000_000)  # a busy computer
        device.run_ticks(2)
        late_ns = clock.now_ns()
        assert device.longest_gap_us(0) == 25_000
        device.run_ticks(30)
        assert device.longest_gap_us(late_ns) == 1_000
        assert device.longest_gap_us(clock.now_ns()) == 0
