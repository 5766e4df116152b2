"""`python -m tools.host_death`: kill, stop and unplug real hosts; when the amplifier goes off."""

from __future__ import annotations

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from dcmp_hil import load_rig
from dcmp_hil.clock import MonotonicClock, pause
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import State
from sim_backend.device import VirtualDevice

_BOUND_S = 60.0
_LOOK_S = 0.002
_TRIES = 10
WAYS = ("SIGKILL", "SIGSTOP", "unplug")


class Death(NamedTuple):
    """How one host ended, and what the device made of it."""

    way: str
    off_us: int | None  # firmware's clock, from the tick before the deed to 0 V; None if the device died
    fault: str  # what the device says it was
    exit_code: int | None  # of the host; None if it was stopped


def die(way: str) -> Death:
    """Let a real host drive a virtual device, end one of them, and look at the other."""
    for _ in range(_TRIES):
        with VirtualDevice(load_rig("bench-1khz"), clock=MonotonicClock()) as device:
            device.start()
            host = _start_host(device.port)
            try:
                if _is_driven(device, host):
                    return _unplug(device, host) if way == "unplug" else _end_host(device, host, way)
            finally:
                host.kill()
                host.communicate(timeout=_BOUND_S)
    raise RuntimeError(f"{_TRIES} hosts ran into the watchdog by themselves: this computer is too busy")


def _end_host(device: VirtualDevice, host: subprocess.Popen[bytes], way: str) -> Death:
    began_us = device.now_us
    host.send_signal(signal.Signals[way])
    _wait(lambda: not device.output.enable, "the amplifier is off")
    off = next(output for output in device.log if output.fault and not output.enable)
    code = host.wait(_BOUND_S) if way == "SIGKILL" else None
    return Death(way, off.since_us - began_us, Fault(off.fault).name, code)


def _unplug(device: VirtualDevice, host: subprocess.Popen[bytes]) -> Death:
    """End the device itself, as a pulled cable does for the host; the host must notice, and say so."""
    os.kill(device.pid, signal.SIGKILL)
    code = host.wait(_BOUND_S)
    return Death("unplug", None, "", code)


def _start_host(port: str) -> subprocess.Popen[bytes]:
    sets = ("--set", f"backend.port={port}", "--set", "reference.soft_start_s=0.5")
    options = ("--duration", "0", "--no-record", "--viewer", "none")
    command = [sys.executable, "-m", "dcmp_hil", "run", "bench-serial", *sets, *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # noqa: S603 - our own


def _is_driven(device: VirtualDevice, host: subprocess.Popen[bytes]) -> bool:
    """Wait until the host drives; False if it ended by itself, as on a computer that is busy elsewhere."""

    def settled() -> bool:
        driven = device.output.state == State.RUN and abs(device.output.voltage_mV) > 100  # noqa: PLR2004 - mV
        return driven or host.poll() is not None

    _wait(settled, "the host drives")
    return host.poll() is None


def _wait(holds: object, what: str) -> None:
    clock = MonotonicClock()
    until_ns = clock.now_ns() + int(1e9 * _BOUND_S)
    while not holds():  # type: ignore[operator]
        if clock.now_ns() > until_ns:
            raise TimeoutError(f"waited {_BOUND_S:g} s until {what}")
        pause(_LOOK_S)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=30, help="hosts of each way")
    parser.add_argument("--json", type=Path, default=Path("host-death.json"), metavar="FILE")
    arguments = parser.parse_args()
    deaths = [die(way) for way in WAYS for _ in range(arguments.n)]
    write = sys.stdout.write
    write("amplifier off after, ms of the firmware's clock (resolution: one period, 1 ms)\n")
    write(f"{'':10}{'n':>4}{'median':>9}{'max':>9}  faults, exit codes\n")
    for way in WAYS:
        these = [death for death in deaths if death.way == way]
        times = [1e-3 * death.off_us for death in these if death.off_us is not None]
        shown = f"{statistics.median(times):9.2f}{max(times):9.2f}" if times else f"{'-':>9}{'-':>9}"
        kinds = sorted({f"{death.fault or '-'} {death.exit_code}" for death in these})
        write(f"{way:10}{len(these):4}{shown}  {', '.join(kinds)}\n")
    arguments.json.write_text(json.dumps([death._asdict() for death in deaths], indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    main()
