# Generated from firmware/proto/dcmp.dbc; `make generate` writes it.
"""Payloads of the messages, without their crc8, by `struct`."""

from __future__ import annotations

from struct import Struct, error
from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.wire.messages import (
    Drive,
    Edge,
    FaultReport,
    Health,
    Hello,
    Identity,
    ParameterGet,
    ParameterSet,
    ParameterValue,
    SampleReport,
    Stop,
)

if TYPE_CHECKING:
    from collections.abc import Callable


class MessageLayout(NamedTuple):
    """A message's class, its payload's length in bytes, and both ways; `pack` raises `struct.error`.

    `pack` returns the payload without its crc8, `unpack` takes it with the crc8.
    """

    kind: Any
    length: int
    pack: Callable[[Any], bytes]
    unpack: Callable[[bytes], Any]


def _check(value: int, most: int) -> None:
    """Raise what `struct` raises if a field does not fit that shares its bytes with others."""
    if not 0 <= value <= most:
        raise error


# `_take_*` reads the crc8's byte, too: the exact length is a little faster than `unpack_from`.


_STOP = Struct("<B")
_take_stop = Struct("<Bx").unpack


def _pack_stop(message: Stop) -> bytes:
    return _STOP.pack(*message)


def _unpack_stop(data: bytes) -> Stop:
    return make(Stop, _take_stop(data))


_DRIVE = Struct("<hHHB")
_take_drive = Struct("<hHHBx").unpack


def _pack_drive(message: Drive) -> bytes:
    (voltage_mV, seq, arm, clear, release, session, ttl_ms) = message
    shared_2 = seq << 3
    if arm:
        shared_2 |= 1
    if clear:
        shared_2 |= 2
    if release:
        shared_2 |= 4
    return _DRIVE.pack(voltage_mV, shared_2, session, ttl_ms)


def _unpack_drive(data: bytes) -> Drive:
    voltage_mV, shared_2, session, ttl_ms = _take_drive(data)
    return make(
        Drive,
        (voltage_mV, shared_2 >> 3, shared_2 & 1 != 0, shared_2 & 2 != 0, shared_2 & 4 != 0, session, ttl_ms),
    )


_FAULT = Struct("<BBi")
_take_fault = Struct("<BBix").unpack


def _pack_fault(message: FaultReport) -> bytes:
    return _FAULT.pack(*message)


def _unpack_fault(data: bytes) -> FaultReport:
    return make(FaultReport, _take_fault(data))


_SAMPLE = Struct("<HBhBB")
_take_sample = Struct("<HBhBBx").unpack
_SAMPLE_BYTE_6 = [(byte & 7, byte & 8 != 0, byte & 16 != 0, byte >> 5) for byte in range(256)]
"""state, missed, limited, fault_class, for each value of their byte."""


def _pack_sample(message: SampleReport) -> bytes:
    (position_counts, voltage_mV, tick, state, missed, limited, fault_class) = message
    _check(state, 7)
    shared_6 = state | fault_class << 5
    if missed:
        shared_6 |= 8
    if limited:
        shared_6 |= 16
    return _SAMPLE.pack(position_counts & 0xFFFF, position_counts >> 16, voltage_mV, tick, shared_6)


def _unpack_sample(data: bytes) -> SampleReport:
    position_counts_low, position_counts_high, voltage_mV, tick, shared_6 = _take_sample(data)
    return make(
        SampleReport,
        (position_counts_low | position_counts_high << 16, voltage_mV, tick) + _SAMPLE_BYTE_6[shared_6],
    )


_EDGE = Struct("<HBHBb")
_take_edge = Struct("<HBHBbx").unpack


def _pack_edge(message: Edge) -> bytes:
    (position_counts, age_us, tick, direction) = message
    return _EDGE.pack(position_counts & 0xFFFF, position_counts >> 16, age_us, tick, direction)


def _unpack_edge(data: bytes) -> Edge:
    position_counts_low, position_counts_high, age_us, tick, direction = _take_edge(data)
    return make(Edge, (position_counts_low | position_counts_high << 16, age_us, tick, direction))


_HELLO = Struct("<HI")
_take_hello = Struct("<HIx").unpack


def _pack_hello(message: Hello) -> bytes:
    return _HELLO.pack(*message)


def _unpack_hello(data: bytes) -> Hello:
    return make(Hello, _take_hello(data))


_IDENTITY = Struct("<IHB")
_take_identity = Struct("<IHBx").unpack
_IDENTITY_BYTE_6 = [(byte & 1 != 0, byte & 2 != 0, byte & 4 != 0) for byte in range(256)]
"""busy, owned, mismatch, for each value of their byte."""


def _pack_identity(message: Identity) -> bytes:
    (protocol_hash, firmware_version, busy, owned, mismatch) = message
    shared_6 = 0
    if busy:
        shared_6 |= 1
    if owned:
        shared_6 |= 2
    if mismatch:
        shared_6 |= 4
    return _IDENTITY.pack(protocol_hash, firmware_version, shared_6)


def _unpack_identity(data: bytes) -> Identity:
    protocol_hash, firmware_version, shared_6 = _take_identity(data)
    return make(Identity, (protocol_hash, firmware_version) + _IDENTITY_BYTE_6[shared_6])


_PARAMETER_GET = Struct("<B")
_take_parameter_get = Struct("<Bx").unpack


def _pack_parameter_get(message: ParameterGet) -> bytes:
    return _PARAMETER_GET.pack(*message)


def _unpack_parameter_get(data: bytes) -> ParameterGet:
    return make(ParameterGet, _take_parameter_get(data))


_PARAMETER_SET = Struct("<HBi")
_take_parameter_set = Struct("<HBix").unpack


def _pack_parameter_set(message: ParameterSet) -> bytes:
    return _PARAMETER_SET.pack(*message)


def _unpack_parameter_set(data: bytes) -> ParameterSet:
    return make(ParameterSet, _take_parameter_set(data))


_PARAMETER_VALUE = Struct("<BiB")
_take_parameter_value = Struct("<BiBx").unpack


def _pack_parameter_value(message: ParameterValue) -> bytes:
    return _PARAMETER_VALUE.pack(*message)


def _unpack_parameter_value(data: bytes) -> ParameterValue:
    return make(ParameterValue, _take_parameter_value(data))


_HEALTH = Struct("<BBBBBB")
_take_health = Struct("<BBBBBBx").unpack


def _pack_health(message: Health) -> bytes:
    return _HEALTH.pack(*message)


def _unpack_health(data: bytes) -> Health:
    return make(Health, _take_health(data))


LAYOUTS = {
    1: MessageLayout(Stop, 2, _pack_stop, _unpack_stop),
    2: MessageLayout(Drive, 8, _pack_drive, _unpack_drive),
    3: MessageLayout(FaultReport, 7, _pack_fault, _unpack_fault),
    4: MessageLayout(SampleReport, 8, _pack_sample, _unpack_sample),
    5: MessageLayout(Edge, 8, _pack_edge, _unpack_edge),
    6: MessageLayout(Hello, 7, _pack_hello, _unpack_hello),
    7: MessageLayout(Identity, 8, _pack_identity, _unpack_identity),
    8: MessageLayout(ParameterGet, 2, _pack_parameter_get, _unpack_parameter_get),
    9: MessageLayout(ParameterSet, 8, _pack_parameter_set, _unpack_parameter_set),
    10: MessageLayout(ParameterValue, 7, _pack_parameter_value, _unpack_parameter_value),
    11: MessageLayout(Health, 7, _pack_health, _unpack_health),
}
"""By message number."""
