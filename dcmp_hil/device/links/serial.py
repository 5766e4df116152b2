"""Frames over a serial port, COBS-framed (pyserial)."""

from __future__ import annotations

import contextlib
import os
import select
import termios
from collections import deque
from typing import TYPE_CHECKING

import serial
from serial.tools import list_ports

from dcmp_hil.config.backends import Serial as SerialSettings
from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.device.links.port_errors import cannot_open, reason
from dcmp_hil.errors import ConfigError, LinkError, OpenError
from dcmp_hil.platform.inherited_descriptors import forget, keep_from_forks
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.carriers import has_samples

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame

FAILURES = (serial.SerialException, OSError, termios.error, ValueError, TypeError)
"""What pyserial raises when a port fails: four unrelated types, TypeError if it was closed meanwhile."""

_READ_BYTES_MAX = 4096
_CARRIER_CHECK_BYTES = 16_384  # bytes, among which another carrier shows
_DELIMITER = b"\0"


def open_serial(rig: Rig, clock: Clock) -> DeviceBackend:
    """Make the backend of a device on a serial port."""
    settings = rig.backend
    if not isinstance(settings, SerialSettings):
        raise ConfigError(f'backend.kind: got "{settings.kind}"; expected "serial".')
    return DeviceBackend(rig, SerialLink(settings.port, settings.baud), clock)


def listen(settings: SerialSettings, _: Clock) -> SerialLink:
    """Return a link that only listens until a frame is sent."""
    return SerialLink(settings.port, settings.baud, listen_only=True)


class SerialLink:
    """A serial port, opened for exclusive use.

    Parameters
    ----------
    port
        Path, or the serial number of its USB adapter.
    baud
        Bit/s.
    listen_only
        Nothing is written but what is sent.
    """

    def __init__(self, port: str, baud: int, *, listen_only: bool = False) -> None:
        self.name = port
        self._baud, self._listen_only = baud, listen_only
        self._serial: serial.Serial | None = None
        self._poll = select.poll()
        self._receiver = cobs.CobsDecoder()
        self._frames: deque[Frame] = deque()
        self._more = True
        self._first = b""  # what was read before the first frame
        self._unknown = True  # whether that carrier is spoken there

    @property
    def corrupt(self) -> int:
        """Number of corrupt frames received so far."""
        return self._receiver.corrupt

    @property
    def other_carrier(self) -> str:
        """Settings for slcan, if that is what was heard."""
        if not has_samples(self._first, slcan.SlcanDecoder()):
            return ""
        return f"--set backend.kind=can --set backend.interface=slcan --set backend.channel={self.name}"

    @property
    def pending(self) -> bool:
        """Whether more was there when the port was read last."""
        return self._more or bool(self._frames)

    def open(self) -> None:
        """Open the port, exclusively, in low-latency mode where there is one.

        Raises
        ------
        OpenError
            If there is none, it is busy, it may not be opened, or it cannot do this baud rate.
        """
        self.name = path = path_of(self.name)
        self._serial = port = open_port(path, self._baud)
        try:
            self._poll = select.poll()
            self._poll.register(port.fileno(), select.POLLIN)
            if not self._listen_only:
                self._write(_DELIMITER)  # ends a frame that the line carried before
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the port."""
        port, self._serial = self._serial, None
        if port is None:
            return
        with contextlib.suppress(*FAILURES):  # it is gone: that is closed
            port.close()

    def send(self, frame: Frame) -> None:
        """Send a frame; what the port has no room for is dropped, for the device to refuse.

        Raises
        ------
        LinkError
            If the port failed.
        """
        self._write(cobs.encode(frame))

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame; None if none was complete within `timeout` (s) of silence.

        Raises
        ------
        LinkError
            If the port failed.
        """
        frames = self._frames
        if frames:
            self._more = True  # since these were read
            return frames.popleft()
        port = self._opened()
        try:
            if not self._poll.poll(1e3 * timeout):
                self._more = False
                return None
            data = port.read(_READ_BYTES_MAX)
        except FAILURES as error:
            raise self._broken(error) from error
        self._more = len(data) == _READ_BYTES_MAX
        frames.extend(self._receiver.feed(data))
        if self._unknown:
            self._keep_first(data)
        return frames.popleft() if frames else None

    def _keep_first(self, data: bytes) -> None:
        """Keep received bytes until the first frame shows that the carrier is right."""
        self._first += data
        self._unknown = not self._frames and len(self._first) < _CARRIER_CHECK_BYTES

    def _write(self, data: bytes) -> None:
        port = self._opened()
        try:
            write_now(port, data)
        except FAILURES as error:
            raise self._broken(error) from error

    def _opened(self) -> serial.Serial:
        if self._serial is None:
            raise LinkError(f"{self.name}: not open. Use the backend as a context manager.")
        return self._serial

    def _broken(self, error: BaseException) -> LinkError:
        return LinkError(
            f"{self.name}: the connection broke ({reason(error)}). The device goes to 0 V by itself. "
            "Plug it in, look at the cable, then start again."
        )


class Port(serial.Serial):
    """A serial port that a process which is forked does not hold: it would keep the lock after our end."""

    def open(self) -> None:
        """Open the port, and keep its descriptor from processes that are forked later."""
        super().open()
        keep_from_forks(self.fileno())

    def close(self) -> None:
        """Close the port; closing a closed port does nothing."""
        if self.is_open:
            forget(self.fileno())
        super().close()


def open_port(path: str, baud: int) -> serial.Serial:
    """Open a serial port for this process alone; reads and writes never block.

    Raises
    ------
    OpenError
        If there is none, it is busy, it may not be opened, or it cannot do this baud rate.
    """
    try:
        port = Port(path, baud, timeout=0, write_timeout=0, exclusive=True)
    except (ValueError, OverflowError) as error:
        raise OpenError(f"{path}: cannot do {baud} baud ({error}). Choose another backend.baud.") from error
    except FAILURES as error:
        raise cannot_open(path, error) from error
    try:
        port.set_low_latency_mode(True)
    except (*FAILURES, NotImplementedError):
        pass  # most ports have no such mode; the round trip is measured before arming
    except BaseException:
        port.close()
        raise
    return port


def write_now(port: serial.Serial, data: bytes) -> None:
    """Write what there is room for; pyserial's own write spins for ever on a full buffer."""
    with contextlib.suppress(BlockingIOError):  # no reader at the other end; the device's watchdog acts
        os.write(port.fileno(), data)


def path_of(port: str) -> str:
    """Return the path of a port that is given by path or by serial number.

    Raises
    ------
    OpenError
        If no port has that serial number.
    """
    if "/" in port or port.upper().startswith("COM"):
        return port
    known = {found.serial_number: found.device for found in list_ports.comports() if found.serial_number}
    if port in known:
        return str(known[port])
    there = ", ".join(f"{number} ({path})" for number, path in known.items()) or "none"
    raise OpenError(
        f"{port}: no serial port has this serial number. There are: {there}. A path contains a slash, "
        "such as /dev/ttyACM0."
    )
