"""Messages to frames and back; the layouts are those of the DBC, which is the judge, in the tests."""

from __future__ import annotations

from struct import error
from typing import TYPE_CHECKING, Any

from dcmp_hil.wire.crc import crc8
from dcmp_hil.wire.layouts import LAYOUTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message


class CorruptFrameError(ValueError):
    """A frame of ours whose crc8 is wrong."""


_ID_CRC = [crc8(number.to_bytes(2, "little")) for number in range(0x800)]
"""crc8 of every identifier: where that of its payload goes on."""
_CRC8_RESIDUE = 0xBD  # what crc8 over a whole message and its own crc8 comes to
_BYTE = [bytes((value,)) for value in range(256)]
_PACK = {layout.kind: (number << 4, layout.pack) for number, layout in LAYOUTS.items()}
_UNPACK = {number: (layout.length, layout.unpack) for number, layout in LAYOUTS.items()}
_UNKNOWN = (-1, None)


def pack(message: Message, node: int = 0) -> Frame:
    """Make the frame of a message.

    Raises
    ------
    ValueError
        If a field does not fit: which one, and its value.
    """
    base, to_bytes = _PACK[type(message)]
    number = base | node
    try:
        body = to_bytes(message)
    except error as cause:
        raise ValueError(f"{type(message).__name__}: {_misfit(message, to_bytes)}") from cause
    return number, body + _BYTE[crc8(body, _ID_CRC[number])]


def _misfit(message: Any, to_bytes: Callable[[Any], bytes]) -> str:
    """Return the field that does not fit, found by trying each among zeros; `struct` does not say."""
    zeros = message._make([0] * len(message))
    fields = message._asdict().items()
    return next(
        f"{name}: {value} does not fit"
        for name, value in fields
        if not _fits(zeros._replace(**{name: value}), to_bytes)
    )


def _fits(message: Any, to_bytes: Callable[[Any], bytes]) -> bool:
    try:
        to_bytes(message)
    except error:
        return False
    return True


def unpack(frame: Frame, node: int = 0) -> Message | None:
    """Return the message in a frame; None if the frame is not ours: other node, number or length.

    Raises
    ------
    CorruptFrameError
        If it is ours but its crc8 is wrong.
    """
    number, data = frame
    length, from_bytes = _UNPACK.get(number >> 4, _UNKNOWN)
    if from_bytes is None or len(data) != length or number & 0xF != node:
        return None
    if crc8(data, _ID_CRC[number]) != _CRC8_RESIDUE:
        raise CorruptFrameError(f"frame {number:03X}#{data.hex().upper()}: its crc8 is wrong")
    message: Message = from_bytes(data)
    return message


def has_wrong_length(frame: Frame, node: int = 0) -> bool:
    """Whether a frame is ours by node and number, and not by its length: damage, or another version."""
    number, data = frame
    length, _ = _UNPACK.get(number >> 4, _UNKNOWN)
    return number & 0xF == node and 0 < length != len(data)
