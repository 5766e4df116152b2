"""A link for every user, as a developer would add it: COBS frames over a TCP connection on this computer."""

from __future__ import annotations

import contextlib
import select
import socket
from collections import deque
from typing import TYPE_CHECKING

from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.errors import LinkError, OpenError
from dcmp_hil.wire import cobs

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.config.backends import Device
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame

_READ_BYTES_MAX = 4096


def open_tcp(rig: Rig, clock: Clock) -> DeviceBackend:
    """Make the backend of a device behind a TCP port."""
    return DeviceBackend(rig, TcpLink(getattr(rig.backend, "tcp_port", 0)), clock)


def listen(settings: Device, _: Clock) -> TcpLink:
    """Return a link that only listens until a frame is sent."""
    return TcpLink(getattr(settings, "tcp_port", 0))


class TcpLink:
    """A TCP connection to 127.0.0.1."""

    other_carrier = ""

    def __init__(self, port: int) -> None:
        self.name = f"127.0.0.1:{port}"
        self._port = port
        self._socket: socket.socket | None = None
        self._receiver = cobs.CobsDecoder()
        self._frames: deque[Frame] = deque()
        self.pending = True

    @property
    def corrupt(self) -> int:
        """Number of corrupt frames received so far."""
        return self._receiver.corrupt

    def open(self) -> None:
        """Connect."""
        try:
            self._socket = socket.create_connection(("127.0.0.1", self._port), timeout=1.0)
        except OSError as error:
            raise OpenError(f"{self.name}: {error.strerror}. Start the device.") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)

    def close(self) -> None:
        """Close the connection; closing a closed one does nothing."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def send(self, frame: Frame) -> None:
        """Send a frame, or drop it if there is no room."""
        try:
            with contextlib.suppress(BlockingIOError):
                self._opened().send(cobs.encode(frame))
        except OSError as error:
            raise LinkError(f"{self.name}: the connection broke. Start again.") from error

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame; None if none came within about `timeout` (s)."""
        if not self._frames:
            self.pending = bool(select.select([self._opened()], [], [], timeout)[0])
            if self.pending:
                data = self._opened().recv(_READ_BYTES_MAX)
                if not data:
                    raise LinkError(f"{self.name}: the connection was closed. Start again.")
                self._frames.extend(self._receiver.feed(data))
        return self._frames.popleft() if self._frames else None

    def _opened(self) -> socket.socket:
        if self._socket is None:
            raise LinkError(f"{self.name}: not open.")
        return self._socket
