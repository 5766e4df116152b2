"""Messages to frames and back; cantools is the judge."""

import random
from binascii import crc_hqx
from enum import IntEnum
from typing import Any

import fastcrc
import pytest
from cantools.database.can import Signal
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.values import Fault
from dcmp_hil.wire.codec import CorruptFrameError, pack, unpack
from dcmp_hil.wire.frame import Frame
from dcmp_hil.wire.messages import Drive, Parameter, ParameterResult, SampleReport, State, StopReason
from tests.firmware.bench import database, encode
from tests.wire.judge import KINDS, NAMES, NODES, crc8, crc16, fields_of, make, signals, span

EXAMPLES = settings(deadline=None, max_examples=60)
FIELDS = [(name, signal) for name in NAMES for signal in signals(name) if signal.length > 1]
NAMED = [f"{name}.{signal.name}" for name, signal in FIELDS]


def _seal(number: int, body: bytes) -> Frame:
    return (number, body + bytes([crc8(number.to_bytes(2, "little") + body)]))


def test_check_values_of_the_checksums() -> None:
    assert (crc8(b"123456789"), fastcrc.crc8.autosar(b"123456789")) == (0xDF, 0xDF)
    assert (crc16(b"123456789"), fastcrc.crc16.ibm_3740(b"123456789")) == (0x29B1, 0x29B1)
    assert crc_hqx(b"123456789", 0xFFFF) == 0x29B1


def test_every_message_has_its_class() -> None:
    assert [message.name for message in database().messages] == NAMES
    for name, kind in KINDS.items():
        assert set(kind._fields) == {signal.name for signal in signals(name)}


@pytest.mark.parametrize("name", NAMES)
def test_number_and_length(name: str) -> None:
    message = database().get_message_by_name(name)
    zeros = make(name, {signal.name: 0 for signal in signals(name)})
    for node in range(16):
        frame = pack(zeros, node)
        assert (frame[0], len(frame[1])) == (message.frame_id + node, message.length)


@pytest.mark.parametrize("name", NAMES)
@EXAMPLES
@given(st.data())
def test_packs_as_cantools_does(name: str, data: st.DataObject) -> None:
    node, fields = data.draw(NODES), data.draw(fields_of(name))
    frame = pack(make(name, fields), node)
    assert type(frame) is tuple
    assert frame == encode(name, node, **fields)
    assert frame == _seal(frame[0], frame[1][:-1])


@pytest.mark.parametrize("name", NAMES)
@EXAMPLES
@given(st.data())
def test_unpacks_as_cantools_does(name: str, data: st.DataObject) -> None:
    """Any payload at all, bits without a name included."""
    message, node = database().get_message_by_name(name), data.draw(NODES)
    body = data.draw(st.binary(min_size=message.length - 1, max_size=message.length - 1))
    frame = _seal(message.frame_id + node, body)
    fields: Any = message.decode(frame[1], decode_choices=False)
    fields.pop("crc8")
    got = unpack(frame, node)
    assert got == make(name, fields)
    assert type(got) is KINDS[name]
    for signal in signals(name):
        assert type(getattr(got, signal.name)) is (bool if signal.length == 1 else int)


@pytest.mark.parametrize(("name", "signal"), FIELDS, ids=NAMED)
def test_pack_knows_how_much_a_field_holds(name: str, signal: Signal) -> None:
    least, most = span(signal)
    fields = {one.name: 0 for one in signals(name)}
    for value in (least, most):
        message = make(name, {**fields, signal.name: value})
        assert unpack(pack(message)) == message
    for value in (least - 1, most + 1, 10 * most, -(1 << 40)):
        with pytest.raises(
            ValueError, match=rf"^{KINDS[name].__name__}: {signal.name}: {value} does not fit$"
        ):
            pack(make(name, {**fields, signal.name: value}))


def test_pack_names_the_field() -> None:
    """The first of two; a number that is no integer fits nowhere."""
    with pytest.raises(ValueError, match=r"^SampleReport: position_counts: -1 does not fit$"):
        pack(SampleReport(-1, 0, 0, 8, False, False, 0))
    with pytest.raises(ValueError, match=r"^Drive: voltage_mV: 1\.5 does not fit$"):
        pack(Drive(1.5, 8191, True, False, False, 65535, 50))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", NAMES)
def test_every_wrong_crc8_is_an_error(name: str) -> None:
    rng = random.Random(name)
    number = database().get_message_by_name(name).frame_id + 5
    for _ in range(10):
        right = _seal(number, rng.randbytes(database().get_message_by_name(name).length - 1))
        assert unpack(right, 5) is not None
        for wrong in set(range(256)) - {right[1][-1]}:
            frame = (number, right[1][:-1] + bytes([wrong]))
            with pytest.raises(CorruptFrameError, match=f"{number:03X}#{frame[1].hex().upper()}"):
                unpack(frame, 5)


@pytest.mark.parametrize("name", NAMES)
def test_other_nodes_and_lengths_are_ignored(name: str) -> None:
    message = database().get_message_by_name(name)
    for node in range(16):
        frame = _seal(message.frame_id + node, bytes(message.length - 1))
        for mine in range(16):
            assert (unpack(frame, mine) is None) == (mine != node)
            if mine != node:
                assert unpack((frame[0], b"\xff" * message.length), mine) is None
        for length in set(range(9)) - {message.length}:
            assert unpack((frame[0], bytes(length)), node) is None
            assert not length or unpack(_seal(frame[0], bytes(length - 1)), node) is None


def test_unknown_numbers_are_ignored() -> None:
    known = {message.frame_id for message in database().messages}
    for number in set(range(0x800)) - {one + node for one in known for node in range(16)}:
        for length in range(1, 9):
            assert unpack((number, bytes(length)), number & 0xF) is None
            assert unpack(_seal(number, bytes(length - 1)), number & 0xF) is None


@pytest.mark.parametrize(
    ("kind", "field", "extra"),
    [
        (State, "SAMPLE.state", {}),
        (StopReason, "STOP.reason", {}),
        (Parameter, "PARAMETER_GET.id", {}),
        (Parameter, "PARAMETER_SET.id", {}),
        (Parameter, "PARAMETER_VALUE.id", {}),
        (ParameterResult, "PARAMETER_VALUE.result", {}),
        (Fault, "FAULT.code", {"TWO_DEVICES": 253, "DISARMED": 254, "UNKNOWN": 255}),
    ],
)
def test_names_of_values(kind: type[IntEnum], field: str, extra: dict[str, int]) -> None:
    message, signal = field.split(".")
    choices = database().get_message_by_name(message).get_signal_by_name(signal).choices
    assert choices is not None
    ours = {name: member.value for name, member in kind.__members__.items()}
    assert ours == {str(name): value for value, name in choices.items()} | extra


def test_a_fault_class_is_a_fault() -> None:
    choices = database().get_message_by_name("SAMPLE").get_signal_by_name("fault_class").choices
    assert choices is not None
    assert {value: str(name) for value, name in choices.items()} == {
        **{fault.value: fault.name for fault in Fault if fault < 7},
        7: "OTHER",
    }
