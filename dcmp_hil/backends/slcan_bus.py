"""python-can's slcan bus, its parser replaced: that one is deaf for ever after one byte that is no ASCII."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import can
from can.interfaces.slcan import slcanBus

from dcmp_hil.backends.serial_link import write_now
from dcmp_hil.wire import slcan
from dcmp_hil.wire.frame import Frame

if TYPE_CHECKING:
    import serial

_CHUNK = 4096


class SlcanBus(slcanBus):
    """An slcan adapter whose damaged lines are dropped and counted, and whose writes never block.

    Parameters
    ----------
    path
        Of the serial port.
    baud
        Of the serial line, bit/s.
    bitrate
        Of the bus, bit/s.
    options
        For python-can's bus.
    """

    def __init__(self, path: str, baud: int, bitrate: int, **options: Any) -> None:
        self._receiver = slcan.Receiver()
        self._frames: deque[Frame] = deque()
        options.setdefault("sleep_after_open", 0.0)
        super().__init__(path, tty_baudrate=baud, bitrate=bitrate, timeout=0, **options)
        self._port.exclusive = True

    @property
    def corrupt(self) -> int:
        """Lines so far that were no frame."""
        return self._receiver.corrupt

    @property
    def _port(self) -> serial.Serial:
        return self.serialPortOrig

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 - never waits
        """Send a frame; what the port has no room for is dropped."""
        write_now(self._port, slcan.encode(Frame(msg.arbitration_id, bytes(msg.data))))

    def _write(self, string: str) -> None:
        write_now(self._port, string.encode() + self.LINE_TERMINATOR)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:  # noqa: ARG002
        if not self._frames:
            self._frames.extend(self._receiver.feed(self._port.read(_CHUNK)))
        if not self._frames:
            return None, False
        frame = self._frames.popleft()
        return can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False), False
