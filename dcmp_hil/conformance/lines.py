"""The three carriers as a check uses them: frames both ways, and raw bytes where the carrier has bytes."""

from __future__ import annotations

import select
from collections import deque
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.conformance.terms import CAN, COBS, SLCAN
from dcmp_hil.device.links.can import CanLink
from dcmp_hil.device.links.port_errors import reason
from dcmp_hil.device.links.serial import FAILURES, open_port, path_of, write_now
from dcmp_hil.errors import LinkError
from dcmp_hil.wire import cobs, slcan

if TYPE_CHECKING:
    from dcmp_hil.config.backends import Can
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame

_READ_BYTES = 4096
_SLCAN_REFUSAL_BYTE = 0x07
_SLCAN_END_BYTE = 0x0D


class RawPort(Protocol):
    """Bytes both ways."""

    name: str

    def read(self, timeout: float) -> bytes:
        """Return the bytes received; wait up to `timeout` (s) if there are none."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes; drop those that do not fit into the output buffer."""
        ...

    def close(self) -> None:
        """Close the port."""
        ...


class CarrierLine(Protocol):
    """A line to a device: frames over a port or a bus."""

    name: str
    carrier: str

    @property
    def damaged(self) -> int:
        """Number of corrupt frames received so far."""
        ...

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        ...

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame; None if none came within about `timeout` (s)."""
        ...

    def close(self) -> None:
        """Close the port under the line."""
        ...


class SerialPort:
    """A serial port, opened for exclusive use.

    Parameters
    ----------
    port
        Path, or the serial number of its USB adapter.
    baud
        Bit/s.

    Raises
    ------
    OpenError
        If it cannot be opened.
    """

    def __init__(self, port: str, baud: int) -> None:
        self.name = path_of(port)
        self._serial = open_port(self.name, baud)
        self._poll = select.poll()
        self._poll.register(self._serial.fileno(), select.POLLIN)

    def read(self, timeout: float) -> bytes:
        """Return the bytes received; wait up to `timeout` (s) if there are none.

        Raises
        ------
        LinkError
            If the port failed.
        """
        try:
            return self._serial.read(_READ_BYTES) if self._poll.poll(1e3 * timeout) else b""
        except FAILURES as error:
            raise self._broken(error) from error

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises
        ------
        LinkError
            If the port failed.
        """
        try:
            write_now(self._serial, data)
        except FAILURES as error:
            raise self._broken(error) from error

    def close(self) -> None:
        """Close the port; the device sees the line hang up where it can."""
        self._serial.close()

    def _broken(self, error: BaseException) -> LinkError:
        return LinkError(
            f"{self.name}: the connection broke ({reason(error)}). Plug it in, look at the cable, then start "
            "again."
        )


class CobsLine:
    """COBS frames on a port."""

    carrier = COBS

    def __init__(self, port: RawPort) -> None:
        self.name, self._port = port.name, port
        self._receiver = cobs.CobsDecoder()
        self._frames: deque[Frame] = deque()
        port.write(b"\0")  # ends what the line carried before

    @property
    def damaged(self) -> int:
        """Number of corrupt frames received so far."""
        return self._receiver.corrupt

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        self._port.write(cobs.encode(frame))

    def write(self, data: bytes) -> None:
        """Send raw bytes."""
        self._port.write(data)

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame."""
        if not self._frames:
            self._frames.extend(self._receiver.feed(self._port.read(timeout)))
        return self._frames.popleft() if self._frames else None

    def close(self) -> None:
        """Close the port."""
        self._port.close()


class SlcanLine:
    """slcan lines on a port; answers to commands are kept apart."""

    carrier = SLCAN

    def __init__(self, port: RawPort) -> None:
        self.name, self._port = port.name, port
        self.answers: list[bytes] = []  # lines that are no frame, without CR; BEL as a line of its own
        self.damaged = 0
        self._line = bytearray()
        self._frames: deque[Frame] = deque()
        port.write(b"\rO\r")  # ends what the line carried before

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        self._port.write(slcan.encode(frame))

    def write(self, data: bytes) -> None:
        """Send raw bytes."""
        self._port.write(data)

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame."""
        if not self._frames:
            for byte in self._port.read(timeout):
                self._take(byte)
        return self._frames.popleft() if self._frames else None

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _take(self, byte: int) -> None:
        if byte == _SLCAN_REFUSAL_BYTE and not self._line:
            self.answers.append(b"\a")
        elif byte == _SLCAN_END_BYTE:
            line = bytes(self._line)
            self._line.clear()
            frames = slcan.SlcanDecoder().feed(line + b"\r")
            self._frames.extend(frames)
            if not frames:
                self.damaged += line[:1] == b"t"
                self.answers.append(line)
        else:
            self._line.append(byte)


class CanLine:
    """Frames on a CAN bus.

    Parameters
    ----------
    settings
        As in `[backend]`.
    clock
        What an interface is waited on with that cannot be polled.

    Raises
    ------
    OpenError, ConfigError
        If there is no such interface, or it cannot be opened.
    """

    carrier = CAN
    damaged = 0  # the controller drops what is damaged

    def __init__(self, settings: Can, clock: Clock) -> None:
        self._link = CanLink(settings, clock)
        self.name = self._link.name
        self._link.open()

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        self._link.send(frame)

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame."""
        return self._link.receive(timeout)

    def close(self) -> None:
        """Close the interface."""
        self._link.close()
