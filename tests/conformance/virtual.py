"""A device in this process as a port of `dcmp_hil.conformance`: it ticks when the host waits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.conformance.client import Client
from dcmp_hil.conformance.lines import CobsLine, SlcanLine

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.conformance.lines import CarrierLine
    from dcmp_hil.wire.frame import Frame

PORT_BYTES_MAX = 4096  # bytes that a port keeps for a host that does not read


class Arm:
    """Moves by the voltage: a count a tick for every 100 mV."""

    def __init__(self, device: Any) -> None:
        self.device = device
        self.ticks = 0
        self.log: list[tuple[int, bool]] = []  # voltage, enable at each tick
        self._counts = 0.0

    def tick(self) -> None:
        self._counts += self.device.applied_mV / 100
        self.ticks += 1
        self.device.tick(round(self._counts))
        self.log.append((self.device.applied_mV, self.device.enable))


class Clock:
    """Time is the device's: to sleep lets it tick."""

    def __init__(self, arm: Arm, period_us: int = 1000) -> None:
        self.arm, self.period_ns = arm, 1000 * period_us

    def now_ns(self) -> int:
        return self.arm.ticks * self.period_ns

    def sleep_until_ns(self, deadline_ns: int) -> None:
        while self.now_ns() < deadline_ns:
            self.arm.tick()


class BytePort:
    """Bytes both ways, at once."""

    name = "virtual"

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.closed = False

    def read(self, timeout: float) -> bytes:
        data: bytes = self.arm.device.transmit()
        if not data and timeout > 0.0:
            self.arm.tick()
            data = self.arm.device.transmit()
        return data

    def write(self, data: bytes) -> None:
        self.arm.device.receive(data)

    def close(self) -> None:
        self.closed = True


class FramePort:
    """A port that carries frames in both directions, as a CAN bus does."""

    name, carrier, damaged = "virtual", "can", 0

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._frames: list[Frame] = []

    def send(self, frame: Frame) -> None:
        self.arm.device.receive_frame(*frame)

    def receive(self, timeout: float) -> Frame | None:
        self._frames += self.arm.device.transmit_frames()
        if not self._frames and timeout > 0.0:
            self.arm.tick()
            self._frames += self.arm.device.transmit_frames()
        return self._frames.pop(0) if self._frames else None

    def close(self) -> None:
        pass


def on(device: Any, carrier: str, stopping: Callable[[], bool] = lambda: False) -> tuple[Client, Arm]:
    """Return a client of a device that was made with this carrier."""
    arm = Arm(device)
    line: CarrierLine
    if carrier == "can":
        line = FramePort(arm)
    else:
        port = BytePort(arm)
        line = CobsLine(port) if carrier == "cobs" else SlcanLine(port)
    return Client(line, Clock(arm, getattr(device, "period_us", 1000)), stopping=stopping), arm
