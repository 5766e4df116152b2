"""Real hosts for the benchmarks of how they end: `dcmp-hil run` against a virtual device."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

from dcmp_hil.errors import ExitCode
from dcmp_hil.platform.clock import MonotonicClock, pause
from dcmp_hil.wire.messages import State

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sim_backend.board.virtual_device import VirtualDevice

WAIT_TIMEOUT_S = 60.0
ATTEMPTS_MAX, DOUBT_MAX_US = 10, 500
_POLL_PERIOD_S = 0.002
_LATE_EXIT_CODES = (ExitCode.BACKEND, ExitCode.TRIP)  # its samples, or its device's commands, came too late
_DRIVEN_mV = 100


def start_host(port: str, *options: str, folder: Path | None = None) -> subprocess.Popen[bytes]:
    """Start a host that runs until it is ended."""
    sets = ("--set", f"backend.port={port}", "--set", "reference.soft_start_s=0.5")
    command = [sys.executable, "-m", "dcmp_hil", "run", "bench-serial", *sets, "--viewer", "none", *options]
    return subprocess.Popen(  # noqa: S603 - our own
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def is_driven(device: VirtualDevice, host: subprocess.Popen[bytes]) -> bool:
    """Wait until the host drives; False if it came too late for its device, as on a computer that is busy.

    Raises
    ------
    RuntimeError
        If it ended for any other reason.
    """

    def settled() -> bool:
        driven = device.output.state == State.RUN and abs(device.output.voltage_mV) > _DRIVEN_mV
        return driven or host.poll() is not None

    wait(settled, "the host drives")
    if host.poll() is None:
        return True
    said = host.stderr.read().decode() if host.stderr else ""
    if host.returncode not in _LATE_EXIT_CODES:
        raise RuntimeError(f"a host ended with {host.returncode} before it drove: {said}")
    return False


def wait(holds: Callable[[], object], what: str, within_s: float = WAIT_TIMEOUT_S) -> None:
    """Poll every 2 ms until a condition holds.

    Raises
    ------
    TimeoutError
        If it does not within `within_s` (s).
    """
    clock = MonotonicClock()
    until_ns = clock.now_ns() + int(1e9 * within_s)
    while not holds():
        if clock.now_ns() > until_ns:
            raise TimeoutError(f"waited {within_s:g} s until {what}")
        pause(_POLL_PERIOD_S)
