"""Frames on a byte stream: slcan lines in upper-case hex."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil.wire.frame import Frame

_LINE_BYTES_MAX = 31  # bytes of a line without its CR
_FRAME_LINE = re.compile(rb"t([0-7][0-9A-F]{2})([1-8])((?:[0-9A-F]{2})+)")
_ADAPTER_ANSWER = re.compile(rb"\x07*(?:[zZ]|V[0-9A-F]{4}|N[0-9A-Z]{4}|F[0-9A-F]{2})?")
_HEADER_CHARS = 5


def encode(frame: Frame) -> bytes:
    """Return the line of a frame, its CR included."""
    number, data = frame
    return b"t%03X%d%s\r" % (number, len(data), data.hex().upper().encode())


class SlcanDecoder:
    """Decodes frames from a stream of bytes in pieces of any length.

    Answers of an adapter to commands are no frames and no damage; everything else is dropped up to the next
    CR and counted in `corrupt`.
    """

    def __init__(self) -> None:
        self.corrupt = 0
        self._rest = b""
        self._too_long = False

    def feed(self, data: bytes) -> list[Frame]:
        """Decode bytes; return the frames that are complete now."""
        *lines, rest = (self._rest + data).split(b"\r")
        frames = []
        for line in lines:
            if self._too_long or len(line) > _LINE_BYTES_MAX:
                self.corrupt += not self._too_long  # or it was counted when it became too long
                self._too_long = False
                continue
            frame = _decode(line)
            if frame is not None:
                frames.append(frame)
            elif not _ADAPTER_ANSWER.fullmatch(line):
                self.corrupt += 1
        if self._too_long or len(rest) > _LINE_BYTES_MAX:
            self.corrupt += not self._too_long
            self._too_long = True
            rest = b""
        self._rest = rest
        return frames


def _decode(line: bytes) -> Frame | None:
    """Return the frame of a line; None if it is none."""
    if line[:1] == b"\x07":  # an adapter's answer to a command it did not like, without a CR of its own
        line = line.lstrip(b"\x07")
    found = _FRAME_LINE.fullmatch(line)
    if found is None or len(line) != _HEADER_CHARS + 2 * int(found[2]):
        return None
    return int(found[1], 16), bytes.fromhex(found[3].decode())
