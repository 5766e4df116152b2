"""Frames on a byte stream: COBS(id, payload, CRC-16) 0x00."""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING

from dcmp_hil.wire.crc import CRC16_START, crc16

if TYPE_CHECKING:
    from dcmp_hil.wire.frame import Frame

_FRAME_BYTES_MIN, _FRAME_BYTES_MAX = 6, 13  # bytes of an encoded frame, without its delimiter
_IDENTIFIER_MAX = 0x7FF
_ID_CRC = [crc16(number.to_bytes(2, "little"), CRC16_START) for number in range(_IDENTIFIER_MAX + 1)]
"""CRC-16/IBM-3740 of every identifier: where that of its payload goes on."""
_two_bytes = Struct("<H").pack
_DISTANCE = [bytes((length + 1,)) for length in range(_FRAME_BYTES_MAX)]
_take_apart = [Struct(f"<xH{max(0, length - 5)}sH").unpack for length in range(_FRAME_BYTES_MAX + 1)]


def _beginning(number: int) -> tuple[bytes, bytes]:
    """Return an identifier with its zeros replaced, up to the last, and what follows that."""
    *ended, open_ = number.to_bytes(2, "little").split(b"\0")
    return b"".join(_DISTANCE[len(part)] + part for part in ended), open_


_BEGINNING = [_beginning(number) for number in range(_IDENTIFIER_MAX + 1)]


def encode(frame: Frame) -> bytes:
    """Return the bytes of a frame, its delimiter included."""
    number, data = frame
    stuffed, begun = _BEGINNING[number]
    for part in (begun + data + _two_bytes(crc16(data, _ID_CRC[number]))).split(b"\0"):
        stuffed += _DISTANCE[len(part)] + part  # every zero becomes the distance to the next
    return stuffed + b"\0"


class CobsDecoder:
    """Decodes frames from a stream of bytes in pieces of any length.

    What is no frame is dropped up to the next 0x00 and counted in `corrupt`.
    """

    def __init__(self) -> None:
        self.corrupt = 0
        self._rest = b""
        self._too_long = False

    def feed(self, data: bytes) -> list[Frame]:
        """Decode bytes; return the frames that are complete now."""
        chunks = (self._rest + data if self._rest else data).split(b"\0")
        rest = chunks.pop()
        frames = []
        for chunk in chunks:
            if self._too_long:
                self._too_long = False  # counted when it became too long
            elif chunk:
                frame = _decode(chunk)
                if frame is not None:
                    frames.append(frame)
                else:
                    self.corrupt += 1
        if self._too_long or len(rest) > _FRAME_BYTES_MAX:
            self.corrupt += not self._too_long
            self._too_long = True
            rest = b""
        self._rest = rest
        return frames


def _decode(chunk: bytes) -> Frame | None:
    """Undo COBS and check what comes out; None if it is no frame."""
    length = len(chunk)
    if not _FRAME_BYTES_MIN <= length <= _FRAME_BYTES_MAX:
        return None
    body, place = bytearray(chunk), chunk[0]
    while place < length:  # every distance becomes the zero that it stands for; the first is not read
        distance = body[place]
        body[place] = 0
        place += distance
    if place != length:
        return None
    number, data, check = _take_apart[length](body)
    if number > _IDENTIFIER_MAX or crc16(data, _ID_CRC[number]) != check:
        return None
    return number, data
