"""A bench on socketcan: the native firmware, an interface of the kernel in front of it, and a host."""

from __future__ import annotations

import os
from contextlib import ExitStack
from typing import TYPE_CHECKING, Self

from dcmp_hil import load_rig
from dcmp_hil.config.backends import Can
from dcmp_hil.device.links.can import open_can
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.wire.messages import State
from sim_backend.board.virtual_device import VirtualDevice
from tests.socketcan.hosts import Host
from tests.socketcan.interfaces import slcan_interface, vcan_interface
from tools.cable import Cable
from tools.hosts import wait

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.device.backend import DeviceBackend

RIG = "bench-can"
WATCHDOG_MS, BRISK_HZ = 20, 250  # of the shipped rig; slower than that, for runs in which other things count
DRIVE_V, DRIVEN_mV = 1.0, 100
SHORT, LONG = 25, 250  # periods
SOON = ("--set", "supervisor.probe=off", "--set", "reference.soft_start_s=0.5")
INTERFACES = {"slcan": slcan_interface, "vcan": vcan_interface}


class Adapter(Cable):
    """A cable that may say something of its own to the host, as an adapter does of its bus."""

    def tell(self, line: bytes) -> None:
        """Send a line."""
        os.write(self._host, line)


class Bench:
    """All of it, running in wall time; its host is made before anything else, because it is forked.

    Parameters
    ----------
    folder
        Of this test.
    kind
        `slcan`: the port is the kernel's own; `vcan`: frames are carried to vcan0.
    rate_hz
        Hz, of device and host.
    """

    def __init__(self, folder: Path, kind: str, *, rate_hz: int = BRISK_HZ) -> None:
        self._kind, self._rate = kind, f"loop.rate_hz={rate_hz}"
        self._stack = ExitStack()
        self.host = Host(folder)
        self._stack.callback(self.host.close)
        rig = load_rig(RIG, [self._rate])
        self.device = VirtualDevice(rig, link="slcan", clock=MonotonicClock())
        self.adapter: Adapter
        self.name = ""
        self.since_us = 0  # of the firmware's clock: when what a test does was done

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stack.push(self._stack.pop_all())
            stack.enter_context(self.device)
            self.device.start()
            self.adapter = stack.enter_context(Adapter(self.device.port))
            self.name = stack.enter_context(INTERFACES[self._kind](self.adapter.port))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def start(self, *arguments: str) -> Host:
        """Start a host on the interface."""
        sets = ("--set", f"backend.channel={self.name}", "--set", self._rate, "--set", "run.end=release")
        self.host.start("run", RIG, *sets, "--viewer", "none", "--no-record", *arguments)
        return self.host

    @property
    def settings(self) -> Can:
        """Of a link to the interface."""
        return Can(kind="can", interface="socketcan", channel=self.name)

    def backend(self) -> DeviceBackend:
        """Return the backend of the rig, in this process, not yet open."""
        return open_can(load_rig(RIG, [f"backend.channel={self.name}", self._rate]), MonotonicClock())

    def drive(self, *arguments: str) -> Host:
        """Start a host, wait until it drives, and return it."""
        started = self.start(*SOON, "--duration", "0", *arguments)
        wait(lambda: started.ended or self._is_driven(), "the host drives")
        assert not started.ended, started.printed()
        return started

    def is_off(self) -> bool:
        """Whether the amplifier has nothing to say."""
        output = self.device.output
        return output.state != State.RUN and output.voltage_mV == 0 and not output.enable

    def off_after_ms(self) -> float:
        """Wait until it is; return for how long it went on after the deed, by the firmware's clock."""
        wait(self.is_off, "the amplifier is off")
        return 1e-3 * ((self.device.output.since_us - self.since_us) & 0xFFFF_FFFF)

    def _is_driven(self) -> bool:
        output = self.device.output
        return output.state == State.RUN and abs(output.voltage_mV) > DRIVEN_mV


def drive(backend: DeviceBackend, periods: int) -> None:
    """Drive for `periods` cycles."""
    for _ in range(periods):
        backend.read()
        backend.write(DRIVE_V)


def drive_into(bench: Bench, deed: Callable[[], object]) -> None:
    """Drive, let something happen, drive on."""
    with bench.backend() as backend:
        drive(backend, SHORT)
        bench.since_us, _ = bench.device.clock_us()
        deed()
        drive(backend, LONG)
