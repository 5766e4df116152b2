"""Frames out of bytes that come in pieces, and what is none of them counted."""

from __future__ import annotations

import random
import tracemalloc
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Health, Hello
from tests.firmware.bench import cobs_wire, slcan_wire, stuff
from tests.wire.judge import crc16, frames, read_cobs, read_slcan, understood

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.frame import Frame

EXAMPLES = settings(deadline=None, max_examples=150)
HEALTH = Health._make([0] * len(Health._fields))._replace(sequence_gaps=1, bus_offs=255, idle_percent=99)
FIRST, SECOND = pack(Hello(0x1200, 0x00C0FFEE), 3), pack(HEALTH, 3)
ANSWERS = (b"", b"z", b"Z", b"V0101", b"NDCMP", b"F00", b"\x07", b"\x07\x07z", b"V1013", b"N0A1Z", b"F8A")


class Carrier(NamedTuple):
    """One of the two carriers of a serial line."""

    module: Any
    decoder: Callable[[], Any]
    wire: Callable[[int, bytes], bytes]  # as others write it
    read: Callable[[bytes], tuple[list[Frame], int]]
    end: bytes
    most: int  # bytes without an end
    alphabets: tuple[bytes, ...]  # of garbage


_BYTES = bytes(range(256))
_OF_COBS = (_BYTES, bytes(range(12)), b"\0\1\2\3")
_OF_SLCAN = (_BYTES, b"t0123456789ABCDEF\r", b"t0123456789ABCDEFTrRabcVN\x07\x8d\n\r", b"tttt0122334\r\r")
COBS = Carrier(cobs, cobs.CobsDecoder, cobs_wire, read_cobs, b"\0", 13, _OF_COBS)
SLCAN = Carrier(slcan, slcan.SlcanDecoder, slcan_wire, read_slcan, b"\r", 31, _OF_SLCAN)
CARRIERS = pytest.mark.parametrize("carrier", [COBS, SLCAN], ids=["COBS", "slcan"])


def _pieces(stream: bytes, sizes: list[int]) -> list[bytes]:
    """Cut a stream; the sizes are used again and again."""
    pieces, at, turn = [], 0, 0
    while at < len(stream):
        pieces.append(stream[at : at + sizes[turn % len(sizes)]])
        at, turn = at + sizes[turn % len(sizes)], turn + 1
    return pieces


def _receive(carrier: Carrier, *pieces: bytes) -> tuple[list[Frame], int]:
    receiver = carrier.decoder()
    found = [frame for piece in pieces for frame in receiver.feed(piece)]
    assert all(type(frame) is tuple and type(frame[1]) is bytes for frame in found)
    return found, receiver.corrupt


def _spoiled(carrier: Carrier) -> st.SearchStrategy[bytes]:
    """Draw the bytes of a frame with one of them changed."""
    return st.builds(
        lambda frame, at, mask: bytes(
            byte ^ (mask if place == at % len(frame) else 0) for place, byte in enumerate(frame)
        ),
        frames().map(lambda frame: carrier.wire(*frame)),
        st.integers(0, 30),
        st.integers(1, 255),
    )


def _almost(carrier: Carrier) -> st.SearchStrategy[bytes]:
    """Draw what is well framed, of any identifier and length."""
    numbers = st.one_of(st.integers(0, 0xFFFF), st.integers(0x7F8, 0x808))
    if carrier is COBS:
        bodies = st.builds(
            lambda number, data: number.to_bytes(2, "little") + data, numbers, st.binary(max_size=12)
        )
        return st.one_of(bodies, st.binary(max_size=2)).map(stuff)
    lines = st.builds(
        lambda kind, number, length, digits: f"{kind}{number:03X}{length}{digits}\r".encode(),
        st.sampled_from("tttTrRx"),
        numbers,
        st.integers(0, 9),
        st.text("0123456789ABCDEFa", max_size=20),
    )
    return st.one_of(lines, st.sampled_from(ANSWERS).map(lambda answer: answer + b"\r"))


def _streams(carrier: Carrier) -> st.SearchStrategy[bytes]:
    good = frames().map(lambda frame: carrier.wire(*frame))
    garbage = st.one_of(
        [st.lists(st.sampled_from(letters), max_size=40).map(bytes) for letters in carrier.alphabets]
    )
    parts = st.one_of(good, good, _spoiled(carrier), _almost(carrier), garbage, st.just(2 * carrier.end))
    return st.lists(parts, max_size=12).map(b"".join)


SIZES = st.lists(st.integers(1, 40), min_size=1, max_size=6)


@CARRIERS
@EXAMPLES
@given(st.data())
def test_written_as_others_write_it(carrier: Carrier, data: st.DataObject) -> None:
    """Any frame of CAN with a payload, ours or not."""
    frame = (data.draw(st.integers(0, 0x7FF)), data.draw(st.binary(min_size=1, max_size=8)))
    assert carrier.module.encode(frame) == carrier.wire(*frame)
    assert _receive(carrier, carrier.wire(*frame)) == ([frame], 0)


@CARRIERS
@EXAMPLES
@given(st.lists(frames(), max_size=10), SIZES, st.integers(0, 3))
def test_round_trip_in_any_pieces(carrier: Carrier, sent: list[Frame], sizes: list[int], ends: int) -> None:
    stream = ends * carrier.end + b"".join(carrier.module.encode(frame) for frame in sent)
    assert _receive(carrier, *_pieces(stream, sizes)) == (sent, 0)
    assert _receive(carrier, stream) == (sent, 0)


@CARRIERS
def test_several_frames_in_one_piece_and_silence_between(carrier: Carrier) -> None:
    first, second = carrier.module.encode(FIRST), carrier.module.encode(SECOND)
    assert _receive(carrier, first + second + first) == ([FIRST, SECOND, FIRST], 0)
    silence = 5 * carrier.end
    assert _receive(carrier, silence + first + silence + second + silence) == ([FIRST, SECOND], 0)
    assert _receive(carrier, b"", b"", silence) == ([], 0)


@CARRIERS
def test_a_frame_comes_with_its_last_byte(carrier: Carrier) -> None:
    receiver = carrier.decoder()
    for frame in (FIRST, SECOND):
        *others, last = _pieces(carrier.module.encode(frame), [1])
        assert [receiver.feed(byte) for byte in others] == [[]] * len(others)
        assert receiver.feed(last) == [frame]


@CARRIERS
@settings(deadline=None, max_examples=300)
@given(st.data())
def test_found_and_counted_as_the_page_says(carrier: Carrier, data: st.DataObject) -> None:
    """Good, damaged and senseless bytes in any order, in one piece, in any pieces, byte by byte."""
    stream = data.draw(_streams(carrier))
    expected = carrier.read(stream)
    assert _receive(carrier, stream) == expected
    assert _receive(carrier, *_pieces(stream, data.draw(SIZES))) == expected
    assert _receive(carrier, *_pieces(stream, [1])) == expected


@CARRIERS
@EXAMPLES
@given(st.data())
def test_in_step_again_after_one_good_frame(carrier: Carrier, data: st.DataObject) -> None:
    garbage = data.draw(st.one_of(st.binary(max_size=80), _streams(carrier)))
    good = carrier.module.encode(FIRST) + carrier.module.encode(SECOND)
    found, _ = _receive(carrier, *_pieces(garbage + good, data.draw(SIZES)))
    assert found[-1] == SECOND
    found, _ = _receive(carrier, *_pieces(garbage + carrier.end + good, data.draw(SIZES)))
    assert found[-2:] == [FIRST, SECOND]


@CARRIERS
@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize("letter", [b"\x01", b"t", b"0"])
def test_too_long_counts_once(carrier: Carrier, size: int, letter: bytes) -> None:
    receiver = carrier.decoder()
    for round_ in range(1, 4):
        receiver.feed(carrier.most * letter)
        assert receiver.corrupt == round_ - 1
        for piece in _pieces(500 * letter, [size]):
            assert receiver.feed(piece) == []
            assert receiver.corrupt == round_
        assert receiver.feed(carrier.end + carrier.module.encode(FIRST)) == [FIRST]
        assert receiver.corrupt == round_


@CARRIERS
def test_what_is_too_long_is_not_kept(carrier: Carrier) -> None:
    receiver, piece = carrier.decoder(), 1000 * b"t"
    tracemalloc.start()
    for _ in range(300):
        receiver.feed(piece)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 30_000


@CARRIERS
def test_as_long_as_can_be_and_one_more(carrier: Carrier) -> None:
    for length in (carrier.most, carrier.most + 1):
        stream = length * b"t" + carrier.end + carrier.module.encode(FIRST)
        assert _receive(carrier, stream) == ([FIRST], 1)
        assert _receive(carrier, *_pieces(stream, [1])) == ([FIRST], 1)


@CARRIERS
def test_random_garbage_is_no_message(carrier: Carrier) -> None:
    rng = random.Random(20_250_101)
    receiver, each = carrier.decoder(), 120_000
    for letters in carrier.alphabets:
        garbage = bytes(rng.choices(letters, k=each))
        for piece in _pieces(garbage, [1, 3, 64, 17, 250]):
            assert not [frame for frame in receiver.feed(piece) if understood(frame)]
    assert each * len(carrier.alphabets) >= 200_000
    assert receiver.corrupt > 10_000
    receiver.feed(carrier.end)
    assert receiver.feed(carrier.module.encode(FIRST)) == [FIRST]


def test_frames_of_every_length_that_cobs_may_not_have() -> None:
    """With a right crc16, all of them."""
    for length in range(20):
        body = bytes(range(1, length + 1))
        expected = ([(0x201, body[2:])], 0) if 3 <= length <= 10 else ([], 1)
        assert _receive(COBS, stuff(body)) == expected
    for number in (0x7FF, 0x800, 0xFFFF):
        expected = ([], 1) if number > 0x7FF else ([(number, b"x")], 0)
        assert _receive(COBS, stuff(number.to_bytes(2, "little") + b"x")) == expected


def test_every_wrong_crc16() -> None:
    body = FIRST[0].to_bytes(2, "little") + FIRST[1]
    assert stuff(body) == cobs.encode(FIRST)
    receiver = cobs.CobsDecoder()
    assert not any(receiver.feed(stuff(body, spoil)) for spoil in range(1, 0x10000, 7))
    assert receiver.corrupt == len(range(1, 0x10000, 7))
    assert crc16(body) == int.from_bytes(cobs.encode((FIRST[0], FIRST[1]))[-3:-1], "little")


@pytest.mark.parametrize("answer", ANSWERS)
def test_answers_of_an_adapter_are_neither_frames_nor_damage(answer: bytes) -> None:
    line = slcan.encode(FIRST)
    stream = answer + b"\r" + line + answer + b"\r" + line
    assert _receive(SLCAN, stream) == ([FIRST, FIRST], 0)
    assert _receive(SLCAN, *_pieces(stream, [1])) == ([FIRST, FIRST], 0)


@pytest.mark.parametrize("line", [b"Zz", b"zz", b"zV0101", b"z\x07", b"V0101F00"])
def test_what_no_adapter_answers_is_damage(line: bytes) -> None:
    assert _receive(SLCAN, line + b"\r") == read_slcan(line + b"\r") == ([], 1)


def test_a_bell_has_no_end_of_its_own() -> None:
    assert _receive(SLCAN, b"\x07" + slcan.encode(FIRST) + b"\x07\x07" + slcan.encode(SECOND)) == (
        [FIRST, SECOND],
        0,
    )


@pytest.mark.parametrize("bells", [31, 32, 100])
def test_bells_are_counted_the_same_in_any_pieces(bells: int) -> None:
    for last in (b"\r", slcan.encode(FIRST)):
        stream = bells * b"\x07" + last + slcan.encode(SECOND)
        expected = read_slcan(stream)
        assert expected[0] == [SECOND]
        assert _receive(SLCAN, stream) == expected
        assert _receive(SLCAN, *_pieces(stream, [1])) == expected


@pytest.mark.parametrize(
    "line",
    [
        b"t0401a0",
        b"t04a100",
        b"t8001AA",
        b"t0400",
        b"t0409" + 18 * b"0",
        b"t0402AA",
        b"t0401AABB",
        b"t0401A",
        b"t040",
        b"T000000401AA",
        b"r0401",
        b"t0401\xc1A",
        b" t0401AA",
        b"t0401AA\n",
        b"V01",
        b"f00",
        b"x",
        b"zt0401AA",
        b"\x07zt0401AA",
        b"t0401\x07AA",
        b"v0101",
        b"F0a",
        b"V01011",
        b"NDCMP1",
    ],
)
def test_lines_that_are_corrupt(line: bytes) -> None:
    assert _receive(SLCAN, b"t0401AA\r" + line + b"\rt0401AA\r") == (2 * [(0x40, b"\xaa")], 1)
