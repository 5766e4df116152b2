"""Messages to frames and back, by `struct`; the DBC is the judge, in the tests."""

from __future__ import annotations

from struct import Struct, error
from typing import TYPE_CHECKING, Any

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.wire import messages
from dcmp_hil.wire.crc import crc8
from dcmp_hil.wire.messages import Drive, Edge, Identity, SampleReport

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message


class CorruptFrameError(ValueError):
    """A frame of ours whose crc8 is wrong."""


_COUNTS = 0xFFFFFF  # 24 bits
_ARM_FLAG, _CLEAR_FLAG, _RELEASE_FLAG = 1, 2, 4
_STATUS_FIELDS = [(byte & 7, byte & 8 != 0, byte & 16 != 0, byte >> 5) for byte in range(256)]
"""State, missed, limited and fault class in SAMPLE's byte of status."""
_DRIVE, _SAMPLE = Struct("<hHHB"), Struct("<HBhBB")
_take_sample = Struct("<HBhBBx").unpack  # without the crc8: exact lengths are a little faster
_EDGE, _IDENTITY = Struct("<HBHBb"), Struct("<IHB")


def _pack_drive(drive: Drive) -> bytes:
    voltage_mV, seq, arm, clear, release, session, ttl_ms = drive
    shared = seq << 3
    if arm:
        shared |= _ARM_FLAG
    if clear:
        shared |= _CLEAR_FLAG
    if release:
        shared |= _RELEASE_FLAG
    return _DRIVE.pack(voltage_mV, shared, session, ttl_ms)


def _unpack_drive(data: bytes) -> Drive:
    voltage_mV, shared, session, ttl_ms = _DRIVE.unpack_from(data)
    arm, clear, release = bool(shared & _ARM_FLAG), bool(shared & _CLEAR_FLAG), bool(shared & _RELEASE_FLAG)
    return Drive(voltage_mV, shared >> 3, arm, clear, release, session, ttl_ms)


def _pack_sample(sample: SampleReport) -> bytes:
    counts, voltage_mV, tick, state, missed, limited, fault_class = sample
    _check(state, 7)
    _check(fault_class, 7)
    _check(counts, _COUNTS)
    status = state | missed << 3 | limited << 4 | fault_class << 5
    return _SAMPLE.pack(counts & 0xFFFF, counts >> 16, voltage_mV, tick, status)


def _unpack_sample(data: bytes) -> SampleReport:
    low, high, voltage_mV, tick, status = _take_sample(data)
    return make(SampleReport, (low | high << 16, voltage_mV, tick) + _STATUS_FIELDS[status])


def _pack_edge(edge: Edge) -> bytes:
    counts, age_us, tick, direction = edge
    _check(counts, _COUNTS)
    return _EDGE.pack(counts & 0xFFFF, counts >> 16, age_us, tick, direction)


def _unpack_edge(data: bytes) -> Edge:
    low, high, age_us, tick, direction = _EDGE.unpack_from(data)
    return Edge(low | high << 16, age_us, tick, direction)


def _pack_identity(identity: Identity) -> bytes:
    protocol_hash, version, busy, owned, mismatch = identity
    return _IDENTITY.pack(protocol_hash, version, busy | owned << 1 | mismatch << 2)


def _unpack_identity(data: bytes) -> Identity:
    protocol_hash, version, flags = _IDENTITY.unpack_from(data)
    return Identity(protocol_hash, version, bool(flags & 1), bool(flags & 2), bool(flags & 4))


def _check(value: int, most: int) -> None:
    if not 0 <= value <= most:
        raise error


def _plain(kind: Any, layout: str) -> tuple[Callable[[Any], bytes], Callable[[bytes], Any], int]:
    """Make both ways of a message whose fields are whole bytes."""
    struct = Struct(layout)
    make = kind._make
    return (lambda message: struct.pack(*message)), (lambda data: make(struct.unpack_from(data))), struct.size


_TABLE: dict[int, tuple[Any, Callable[[Any], bytes], Callable[[bytes], Any], int]] = {
    1: (messages.Stop, *_plain(messages.Stop, "<B")),
    2: (Drive, _pack_drive, _unpack_drive, _DRIVE.size),
    3: (messages.FaultReport, *_plain(messages.FaultReport, "<BBi")),
    4: (SampleReport, _pack_sample, _unpack_sample, _SAMPLE.size),
    5: (Edge, _pack_edge, _unpack_edge, _EDGE.size),
    6: (messages.Hello, *_plain(messages.Hello, "<HI")),
    7: (Identity, _pack_identity, _unpack_identity, _IDENTITY.size),
    8: (messages.ParameterGet, *_plain(messages.ParameterGet, "<B")),
    9: (messages.ParameterSet, *_plain(messages.ParameterSet, "<HBi")),
    10: (messages.ParameterValue, *_plain(messages.ParameterValue, "<BiB")),
    11: (messages.Health, *_plain(messages.Health, "<6B")),
}
_ID_CRC = [crc8(number.to_bytes(2, "little")) for number in range(0x800)]
"""crc8 of every identifier: where that of its payload goes on."""
_CRC8_RESIDUE = 0xBD  # what crc8 over a whole message and its own crc8 comes to
_BYTE = [bytes((value,)) for value in range(256)]
_PACK = {kind: (number << 4, pack) for number, (kind, pack, _, _) in _TABLE.items()}
_UNPACK = {number: (size + 1, unpack) for number, (_, _, unpack, size) in _TABLE.items()}
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
