"""The host's end of a virtual device's port."""

from __future__ import annotations

import os
import select
from contextlib import contextmanager
from typing import TYPE_CHECKING

from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import (
    Drive,
    Hello,
    State,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.wire.messages import Message
    from sim_backend.board.virtual_device import VirtualDevice

SESSION = 0x4321
PATIENT_S = 5.0  # s, wall: how long a test waits for what must come
PATIENT_MS = 5000


class Terminal:
    """The host's end of a port."""

    def __init__(self, path: str, carrier: str = "cobs") -> None:
        self._file = os.open(path, os.O_RDWR | os.O_NOCTTY)
        self._encode = cobs.encode if carrier == "cobs" else slcan.encode
        self.receiver = cobs.CobsDecoder() if carrier == "cobs" else slcan.SlcanDecoder()
        self.seq = 0

    def close(self) -> None:
        os.close(self._file)

    def write(self, data: bytes) -> None:
        os.write(self._file, data)

    def read(self, seconds: float = PATIENT_S) -> bytes:
        ready, _, _ = select.select([self._file], [], [], seconds)
        return os.read(self._file, 65536) if ready else b""

    def say(self, message: Message) -> None:
        self.write(self._encode(pack(message, 0)))

    def hear(self, seconds: float = PATIENT_S) -> list[Message | None]:
        """Return the messages within `seconds`, at least one if any arrives."""
        found: list[Message | None] = []
        while not found and (data := self.read(seconds)):
            found = [unpack(frame, 0) for frame in self.receiver.feed(data)]
        return found

    def drive(self, voltage_mV: int, *, arm: bool = True) -> None:
        self.say(Drive(voltage_mV, self.seq, arm, False, False, SESSION, 20))


@contextmanager
def connected(device: VirtualDevice, carrier: str = "cobs") -> Iterator[Terminal]:
    """Open the port of a device, and close it."""
    terminal = Terminal(device.port, carrier)
    try:
        yield terminal
    finally:
        terminal.close()


def arm(device: VirtualDevice, host: Terminal, voltage_mV: int = 2000) -> None:
    """Arm a device whose ticks this test makes, until its voltage is applied."""
    device.run_ticks(2)
    host.say(Hello(SESSION, PROTOCOL_HASH))
    for k in range(40):
        host.seq = device.tick_count - 1
        host.drive(voltage_mV if device.output.state == State.RUN else 0)
        heard = host.hear()
        device.run_ticks(1)
        assert heard, f"nothing heard at tick {k}"
        if device.output.voltage_mV == voltage_mV:
            return
    raise AssertionError(f"not armed: {device.output}")
