"""What the page says, said a second time: by cantools, by the cobs package, bit by bit."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from hypothesis import strategies as st

from dcmp_hil.wire import messages
from dcmp_hil.wire.codec import CorruptFrameError, unpack
from tests.firmware.bench import database, encode, unstuff

if TYPE_CHECKING:
    from cantools.database.can import Signal

    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message

KINDS: dict[str, Any] = {
    "STOP": messages.Stop,
    "DRIVE": messages.Drive,
    "FAULT": messages.FaultReport,
    "SAMPLE": messages.SampleReport,
    "EDGE": messages.Edge,
    "HELLO": messages.Hello,
    "IDENTITY": messages.Identity,
    "PARAMETER_GET": messages.ParameterGet,
    "PARAMETER_SET": messages.ParameterSet,
    "PARAMETER_VALUE": messages.ParameterValue,
    "HEALTH": messages.Health,
}
NAMES = list(KINDS)
NODES = st.integers(0, 15)


def crc8(data: bytes) -> int:
    """CRC-8/AUTOSAR, bit by bit."""
    value = 0xFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value << 1 ^ (0x2F if value & 0x80 else 0)) & 0xFF
    return value ^ 0xFF


def crc16(data: bytes) -> int:
    """CRC-16/IBM-3740, bit by bit."""
    value = 0xFFFF
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ (0x1021 if value & 0x8000 else 0)) & 0xFFFF
    return value


def signals(name: str) -> list[Signal]:
    """Return a message's fields but crc8."""
    return [signal for signal in database().get_message_by_name(name).signals if signal.name != "crc8"]


def span(signal: Signal) -> tuple[int, int]:
    """Return the smallest and the largest number that a field's bits can hold."""
    if signal.is_signed:
        return -(1 << signal.length - 1), (1 << signal.length - 1) - 1
    return 0, (1 << signal.length) - 1


def fields_of(name: str) -> st.SearchStrategy[dict[str, int]]:
    """Draw a message's fields, each from all that its bits can hold."""
    return st.fixed_dictionaries({signal.name: st.integers(*span(signal)) for signal in signals(name)})


def make(name: str, fields: dict[str, int]) -> Message:
    """Return a message of the host's; one bit is a bool."""
    flags = {signal.name for signal in signals(name) if signal.length == 1}
    message: Message = KINDS[name](**{key: bool(at) if key in flags else at for key, at in fields.items()})
    return message


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    """Draw a genuine frame of any message and node."""
    name = draw(st.sampled_from(NAMES))
    return encode(name, draw(NODES), **draw(fields_of(name)))


def understood(frame: Frame) -> Message | None:
    """Return the message in a frame of any node; None if there is none or its crc8 is wrong."""
    try:
        return unpack(frame, frame[0] & 0xF)
    except CorruptFrameError:
        return None


def read_cobs(stream: bytes) -> tuple[list[Frame], int]:
    """Return the frames of a whole COBS stream and how many were corrupt."""
    *chunks, rest = stream.split(b"\0")
    found, corrupt = [], int(len(rest) > 13)
    for chunk in filter(None, chunks):
        body = unstuff(chunk) if len(chunk) <= 13 else b""
        number = int.from_bytes(body[:2], "little")
        if 5 <= len(body) <= 12 and number < 0x800 and body[-2:] == crc16(body[:-2]).to_bytes(2, "little"):
            found.append((number, body[2:-2]))
        else:
            corrupt += 1
    return found, corrupt


def read_slcan(stream: bytes) -> tuple[list[Frame], int]:
    """Return the frames of a whole slcan stream and how many lines were corrupt."""
    *lines, rest = stream.split(b"\r")
    found, corrupt = [], int(len(rest) > 31)
    for line in lines:
        bare = line.lstrip(b"\x07")  # an adapter's "no", which has no CR
        if len(line) <= 31 and _well_formed(bare):
            found.append((int(bare[1:4], 16), bytes.fromhex(bare[5:].decode())))
        elif len(line) > 31 or not (bare in (b"", b"z", b"Z") or _is_answer(bare)):
            corrupt += 1
    return found, corrupt


def _well_formed(line: bytes) -> bool:
    return (
        line[:1] == b"t"
        and all(byte in b"0123456789ABCDEF" for byte in line[1:])
        and line[1:2] < b"8"
        and line[4:5] in list(map(b"%d".__mod__, range(1, 9)))
        and len(line) == 5 + 2 * int(line[4:5])
    )


def _is_answer(line: bytes) -> bool:
    return re.fullmatch(rb"V[0-9A-F]{4}|N[0-9A-Z]{4}|F[0-9A-F]{2}", line) is not None
