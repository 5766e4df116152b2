"""An slcan adapter as a bus of python-can: alone on its port, strict, never waiting.

python-can's own is deaf for ever after one byte that is no ASCII, waits for every write, and speaks to a port
before it could know that another program has it.
"""

from __future__ import annotations

import contextlib
from collections import deque
from typing import TYPE_CHECKING

import can

from dcmp_hil.device.links.serial import FAILURES, open_port, write_now
from dcmp_hil.errors import ConfigError
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.carriers import has_samples

if TYPE_CHECKING:
    import serial

    from dcmp_hil.wire.frame import Frame

_READ_BYTES_MAX = 4096
_DEVICE_NAME_ANSWER = b"NDCMP\r"  # what a device of this project answers to N
_NAME_ANSWER_BYTES_MAX = 16_384  # bytes, among which that answer is
_BITRATES = {
    rate: code
    for code, rate in enumerate(
        (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 750_000, 1_000_000)
    )
}


class SlcanBus(can.BusABC):
    """An slcan adapter whose damaged lines are dropped and counted.

    Parameters
    ----------
    path
        Of the serial port.
    baud
        Of the serial line, bit/s.
    bitrate
        Of the bus, bit/s.
    listen_only
        Nothing is written but what is sent: a closed adapter stays closed, and silent.

    Raises
    ------
    OpenError
        If the port cannot be opened.
    ConfigError
        If slcan has no such bit rate.
    """

    def __init__(self, path: str, baud: int, bitrate: int, *, listen_only: bool = False) -> None:
        if bitrate not in _BITRATES:
            raise ConfigError(
                f"backend.bitrate: got {bitrate}; slcan has {', '.join(map(str, _BITRATES))} bit/s."
            )
        self._receiver = slcan.SlcanDecoder()
        self._frames: deque[Frame] = deque()
        self._listen_only = listen_only
        self._first = b""  # of what was read
        self._port: serial.Serial = open_port(path, baud)
        self.channel_info = f"slcan {path}"
        try:
            self._command("", "C", f"S{_BITRATES[bitrate]}", "N", "O")  # the empty one ends what came before
            super().__init__(path)
        except BaseException:
            self._port.close()
            raise

    @property
    def corrupt(self) -> int:
        """Number of received lines so far that were no frame."""
        return self._receiver.corrupt

    @property
    def is_cobs(self) -> bool:
        """Whether what was heard first are COBS frames of a device of ours."""
        return has_samples(self._first, cobs.CobsDecoder())

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 - never waits
        """Send a frame; what the port has no room for is dropped."""
        write_now(self._port, slcan.encode((msg.arbitration_id, bytes(msg.data))))

    def fileno(self) -> int:
        """Return the descriptor of the port, to wait on."""
        return self._port.fileno()

    def shutdown(self) -> None:
        """Close the channel and the port; a device of ours goes on sending, for who only listens."""
        super().shutdown()
        with contextlib.suppress(*FAILURES):  # it is gone: that is closed
            if _DEVICE_NAME_ANSWER not in self._first:
                self._command("C")
        self._port.close()

    def _command(self, *commands: str) -> None:
        if self._listen_only:
            return
        for command in commands:
            write_now(self._port, command.encode() + b"\r")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:  # noqa: ARG002
        if not self._frames:
            data = self._port.read(_READ_BYTES_MAX)
            if len(self._first) < _NAME_ANSWER_BYTES_MAX:
                self._first += data
            self._frames.extend(self._receiver.feed(data))
        if not self._frames:
            return None, False
        number, data = self._frames.popleft()
        return can.Message(arbitration_id=number, data=data, is_extended_id=False), False
