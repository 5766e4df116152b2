"""Rung C: the target's code in QEMU, in plant time, against the same code on this computer."""

from __future__ import annotations

import hashlib
import math
import sys
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.factory import open_backend
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import State
from sim_backend.board.virtual_device import VirtualDevice
from tests.contract.benches import PatientClock
from tests.helpers import bench
from tests.target.build import needed

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

STILL = ("model.eta_rad_s2=0.0", "model.eta_amplitude_rad_s2=0.0")  # no disturbance that depends on the time
CYCLE_COUNT = 5000
_PATIENT_MS = 10_000


@pytest.fixture(scope="module")
def qemu(f405: Path) -> Sequence[str]:
    """Return the command that starts the board in the emulator."""
    needed("qemu-system-arm")
    return [sys.executable, "-m", "tools.qemu_device", "--elf", str(f405 / "qemu_f405.elf")]


def trace(program: Sequence[str], link: str, cycles: int) -> str:
    """Close a loop that swings far and reverses often; return the hash of all that the host saw."""
    seen = hashlib.sha256()
    swings = 0
    with VirtualDevice(bench(*STILL), link=link, patience_ms=_PATIENT_MS, program=program) as device:
        way = (
            ("backend.kind=serial", f"backend.port={device.port}")
            if link == "cobs"
            else ("backend.kind=can", "backend.interface=slcan", f"backend.channel={device.port}")
        )
        device.start()
        with open_backend(bench(*STILL, *way), PatientClock()) as backend:
            for k in range(cycles):
                sample = backend.read()
                assert round(1e3 * sample.t) == k
                seen.update(repr((sample.t, sample.position, sample.voltage)).encode())
                swings += abs(sample.voltage) > 2.0
                backend.write(6.0 * math.sin(0.02 * k) - 20.0 * sample.position)
        assert device.error is None
        assert device.output.state == State.IDLE
    assert swings > cycles / 10
    return seen.hexdigest()


def test_trace_is_that_of_the_native_board(qemu: Sequence[str]) -> None:
    assert trace(qemu, "cobs", CYCLE_COUNT) == trace((), "cobs", CYCLE_COUNT)


def test_trace_is_that_of_the_native_board_over_slcan(qemu: Sequence[str]) -> None:
    assert trace(qemu, "slcan", 500) == trace((), "slcan", 500)


def test_silent_host_is_noticed_on_the_target(qemu: Sequence[str]) -> None:
    with VirtualDevice(bench(*STILL), patience_ms=50, program=qemu) as device:
        way = ("backend.kind=serial", f"backend.port={device.port}")
        device.start()
        with open_backend(bench(*STILL, *way), PatientClock()) as backend:
            for _ in range(50):
                backend.read()
                backend.write(2.0)
            while not device.output.fault:
                assert device.error is None
        off = next(output for output in tuple(device.log) if output.fault)
    assert Fault(off.fault) is Fault.HOST_SILENT
    assert (off.voltage_mV, off.enable) == (0, 0)
    assert 20_000 < off.since_us - off.fed_us <= 21_000
