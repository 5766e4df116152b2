"""Frames on a byte stream: COBS(id, payload, CRC-16) 0x00."""

from __future__ import annotations

from fastcrc import crc16

from dcmp_hil.wire.frame import Frame

_crc = crc16.ibm_3740
_LEAST, _MOST = 5, 12  # bytes of identifier, payload and crc16
_HIGHEST = 7  # of the identifier's upper byte
_LONGEST = _MOST + 1  # encoded, without delimiter


def encode(frame: Frame) -> bytes:
    """Return the bytes of a frame, its delimiter included."""
    body = frame.id.to_bytes(2, "little") + frame.data
    body += _crc(body).to_bytes(2, "little")
    return b"".join([bytes((len(part) + 1,)) + part for part in body.split(b"\0")]) + b"\0"


class Receiver:
    """Finds frames in bytes that come in pieces.

    What is no frame is dropped up to the next 0x00 and counted in `corrupt`.
    """

    def __init__(self) -> None:
        self.corrupt = 0
        self._rest = b""
        self._too_long = False

    def feed(self, data: bytes) -> list[Frame]:
        """Take bytes; return the frames that are complete now."""
        *chunks, rest = (self._rest + data).split(b"\0")
        frames = []
        for chunk in chunks:
            if self._too_long:
                self._too_long = False  # counted when it became too long
            elif chunk:
                frame = _decode(chunk)
                if frame is None:
                    self.corrupt += 1
                else:
                    frames.append(frame)
        if self._too_long or len(rest) > _LONGEST:
            self.corrupt += not self._too_long
            self._too_long = True
            rest = b""
        self._rest = rest
        return frames


def _decode(chunk: bytes) -> Frame | None:
    """Undo COBS and check what comes out; None if it is no frame."""
    if len(chunk) > _LONGEST:
        return None
    parts, place, length = [], 0, len(chunk)
    while place < length:
        end = place + chunk[place]
        if end > length:
            return None
        parts.append(chunk[place + 1 : end])
        place = end
    body = b"\0".join(parts)
    if not _LEAST <= len(body) <= _MOST or body[1] > _HIGHEST:
        return None
    if _crc(body[:-2]) != body[-2] | body[-1] << 8:
        return None
    return Frame(body[0] | body[1] << 8, body[2:-2])
