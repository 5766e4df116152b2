"""CAN interfaces of the kernel with a device behind them."""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import socket
import struct
import subprocess
import threading
import tty
from typing import TYPE_CHECKING

from dcmp_hil.wire import slcan

if TYPE_CHECKING:
    from collections.abc import Iterator

_TIOCSETD, _SIOCGIFNAME = 0x5423, 0x8910
_N_SLCAN = 17
_OPEN = b"C\rS8\rO\r"  # what slcand says
_FRAME = struct.Struct("=IB3x8s")
ERROR = 0x2000_0000  # flag of an error frame; below it the classes of error
BUS_OFF = 0x40
_CHUNK_BYTES_MAX = 4096


def ip(*words: str) -> None:
    """Run `ip link ...`, as a user does."""
    subprocess.run(["ip", "link", *words], check=True)


def bring_up(name: str) -> None:
    ip("set", name, "up")


def take_down(name: str) -> None:
    ip("set", name, "down")


@contextlib.contextmanager
def slcan_interface(port: str) -> Iterator[str]:
    """Give the port to the kernel's own slcan, as slcand does; the interface is there while it is open."""
    line = os.open(port, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(line)
        os.write(line, _OPEN)
        fcntl.ioctl(line, _TIOCSETD, struct.pack("i", _N_SLCAN))
        name = fcntl.ioctl(line, _SIOCGIFNAME, bytes(16)).rstrip(b"\0").decode()
        bring_up(name)
        yield name
    finally:
        os.close(line)


@contextlib.contextmanager
def vcan_interface(port: str) -> Iterator[str]:
    """Carry frames between the port and vcan0."""
    ip("add", "vcan0", "type", "vcan")
    try:
        bring_up("vcan0")
        with Bridge(port, "vcan0"):
            yield "vcan0"
    finally:
        ip("delete", "vcan0")


def raw_socket(name: str) -> socket.socket:
    """Open a socket that sends, and hears nothing of other senders but frames."""
    raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    raw.bind((name,))
    return raw


def frame(identifier: int, data: bytes = bytes(8)) -> bytes:
    """Return a frame as the kernel wants it; the identifier holds its flags."""
    return _FRAME.pack(identifier, len(data), data)


class Bridge:
    """Carries frames between a port that speaks slcan and an interface, until the interface goes down."""

    def __init__(self, port: str, name: str) -> None:
        self._line = os.open(port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._line)
        self._raw = raw_socket(name)
        self._end, self._wish = os.pipe()
        self._receiver = slcan.SlcanDecoder()
        self._thread = threading.Thread(target=self._carry, name="bridge", daemon=True)

    def __enter__(self) -> None:
        os.write(self._line, _OPEN)
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        os.write(self._wish, b"!")
        self._thread.join()
        self._raw.close()
        for end in (self._line, self._end, self._wish):
            os.close(end)

    def _carry(self) -> None:
        poll = select.poll()
        for end in (self._line, self._raw.fileno(), self._end):
            poll.register(end, select.POLLIN)
        while True:
            ready = {end for end, _ in poll.poll()}
            if self._end in ready:
                return
            with contextlib.suppress(OSError):  # the interface is down: what is said then is lost
                if self._line in ready:
                    self._to_bus()
                if self._raw.fileno() in ready:
                    self._to_device()

    def _to_bus(self) -> None:
        for received in self._receiver.feed(os.read(self._line, _CHUNK_BYTES_MAX)):
            self._raw.send(frame(*received))

    def _to_device(self) -> None:
        identifier, length, data = _FRAME.unpack(self._raw.recv(_FRAME.size))
        if identifier < 1 << 11:
            os.write(self._line, slcan.encode((identifier, data[:length])))
