"""`dcmp-hil device`: a port that other programs open, and an end that leaves nothing behind."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import can
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.cli.conftest import Outcome

pytestmark = pytest.mark.usefixtures("needs_compiler")

_TIMEOUT_S = 60.0  # s: generous, these machines are shared


@contextmanager
def running(folder: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a device; give the process and its port."""
    process = subprocess.Popen(
        [sys.executable, "-m", "dcmp_hil", "device", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.communicate(timeout=_TIMEOUT_S)


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def end(process: subprocess.Popen[str], number: signal.Signals) -> tuple[int, str]:
    process.send_signal(number)
    _, err = process.communicate(timeout=_TIMEOUT_S)
    return process.returncode, err


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 143)])
def test_device_ends_clean_when_signalled(tmp_path: Path, number: signal.Signals, code: int) -> None:
    with running(tmp_path, "--symlink", "port") as (process, port):
        assert port == "port"
        assert (tmp_path / port).is_char_device()
        (firmware,) = children(process.pid)
        ended, err = end(process, number)
    assert ended == code, err
    assert "Traceback" not in err
    assert not Path(f"/proc/{firmware}").exists()
    assert not (tmp_path / port).is_symlink()


def test_firmware_goes_when_its_plant_is_killed(tmp_path: Path) -> None:
    with running(tmp_path) as (process, port):
        (firmware,) = children(process.pid)
        held = os.pidfd_open(firmware)
        process.kill()
        process.wait(_TIMEOUT_S)
        assert select.select([held], [], [], _TIMEOUT_S)[0] == [held]
        os.close(held)
        assert not Path(port).exists()


def test_device_says_how_to_run_against_it(tmp_path: Path) -> None:
    with running(tmp_path, "bench-can", "--link", "slcan", "--set", "loop.rate_hz=500.0") as (process, port):
        assert Path(port).is_char_device()
        _, err = end(process, signal.SIGINT)
    said = "dcmp-hil run bench-can --set loop.rate_hz=500.0 --set backend.kind=can "
    assert f"{said}--set backend.interface=slcan --set backend.channel={port}" in err


def test_terminal_is_shown_how_things_stand(tmp_path: Path) -> None:
    screen, terminal = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "dcmp_hil", "device", "--set", "sim.position_rad=1.25"],
        cwd=tmp_path,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "120"},
        stdout=subprocess.DEVNULL,
        stderr=terminal,
    )
    os.close(terminal)
    try:
        shown = b""
        while b" rad" not in shown and select.select([screen], [], [], _TIMEOUT_S)[0]:
            shown += os.read(screen, 4096)
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(_TIMEOUT_S) == 0
        os.close(screen)
    for word in (b"tick", b"closed", b"IDLE", b"no session", b"+0.000 V", b" rad"):
        assert word in shown


def test_python_can_s_own_slcan_bus_hears_it(tmp_path: Path) -> None:
    with running(tmp_path, "--link", "slcan") as (process, port):
        with can.Bus(channel=port, interface="slcan", ignore_config=True, sleep_after_open=0.0) as bus:
            heard = [bus.recv(_TIMEOUT_S) for _ in range(200)]
        assert end(process, signal.SIGINT)[0] == 0
    found = [message for message in heard if message is not None]
    assert len(found) == 200
    assert {message.arbitration_id for message in found} <= {0x040, 0x0B0}
    ticks = [message.data[5] for message in found if message.arbitration_id == 0x040]
    steps = {(later - earlier) % 256 for earlier, later in pairwise(ticks)}
    assert steps == {1}


def test_run_against_it_in_real_time(cli: Callable[..., Outcome], tmp_path: Path) -> None:
    def against(port: str, rate: str) -> Outcome:
        keys = (
            "backend.kind=serial",
            f"backend.port={port}",
            "backend.watchdog_ms=50",
            f"loop.rate_hz={rate}",
        )
        sets = [word for key in keys for word in ("--set", key)]
        return cli("run", *sets, "--duration", "0.3", "--no-record", "--viewer", "none")

    with running(tmp_path, "--set", "loop.rate_hz=100.0") as (process, port):
        fits = against(port, "100.0")
        for _ in range(4):  # a computer that is busy elsewhere may keep either side waiting for too long
            fits = fits if fits.code == 0 else against(port, "100.0")
        other_rate = against(port, "200.0")
        assert end(process, signal.SIGINT)[0] == 0
    assert fits.code == 0, fits.err
    assert "voltage, peak" in fits.out
    assert "unknown" not in fits.out  # on a device nothing knows the truth; tracking has not begun yet
    assert other_rate.code == 2
    assert "the device 100" in other_rate.err


def test_compiler_that_is_missing_is_one_line_and_code_3(
    cli: Callable[..., Outcome], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "/no/such/cc")
    outcome = cli("device")
    assert outcome.code == 3
    assert outcome.out == ""
    assert len(outcome.err.splitlines()) == 1
    assert "apt install gcc" in outcome.err


def test_rig_that_no_device_can_be_is_code_2(cli: Callable[..., Outcome]) -> None:
    outcome = cli("device", "paper")
    assert outcome.code == 2
    assert 'encoder.counts_per_rev = "ideal"' in outcome.err


def test_symlink_that_cannot_be_made_is_code_2(cli: Callable[..., Outcome], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    outcome = cli("device", "--symlink", "file")
    assert outcome.code == 2
    assert (tmp_path / "file").read_text() == "mine"
