"""COBS and slcan: what the page says, against independent encoders."""

import random
from typing import Any

import fastcrc
import pytest

from tests.firmware.bench import Core, cobs_wire, slcan_wire, stuff, unstuff

CR, BEL = b"\r", b"\x07"


class Receiver:
    """Either carrier's receiver."""

    def __init__(self, core: Core, kind: str) -> None:
        self.core = core
        self.state: Any = core.new(f"struct dcmp_{kind} *")
        self.take = getattr(core.lib, f"dcmp_{kind}_receive")
        getattr(core.lib, f"dcmp_{kind}_init")(self.state)

    def feed(self, data: bytes) -> list[Any]:
        frame = self.core.new("struct dcmp_frame *")
        lib = self.core.lib
        made: list[Any] = []
        for byte in data:
            received = self.take(self.state, byte, frame)
            if received == lib.DCMP_FRAME:
                made.append(self.core.read(frame))
                assert not any(frame.data[frame.length : 8])
            elif received == lib.DCMP_CORRUPT:
                made.append("corrupt")
            elif received == lib.DCMP_REPLY:
                made.append(bytes(self.state.reply[0 : self.state.reply_length]))
        return made


def _random_frame(rng: random.Random) -> tuple[int, bytes]:
    return rng.randrange(0x800), bytes(
        rng.choice([0, 1, 255, rng.randrange(256)]) for _ in range(rng.randint(1, 8))
    )


def test_cobs_both_ways(core: Core) -> None:
    rng = random.Random(3)
    receiver = Receiver(core, "cobs")
    for _ in range(2000):
        number, payload = _random_frame(rng)
        out = core.new("uint8_t[14]")
        size = core.lib.dcmp_cobs_send(core.frame(number, payload), out)
        assert bytes(out[0:size]) == cobs_wire(number, payload)
        assert receiver.feed(bytes(out[0:size])) == [(number, payload)]


@pytest.mark.parametrize(
    ("data", "made"),
    [
        (b"\0\0\0", []),
        (b"\x01\0", ["corrupt"]),
        (b"\x05\x01\0", ["corrupt"]),
        (stuff(b"12"), ["corrupt"]),
        (cobs_wire(0x123, b""), ["corrupt"]),
        (cobs_wire(0x7FF, b"x"), [(0x7FF, b"x")]),
        (cobs_wire(0x800, b"x"), ["corrupt"]),
        (cobs_wire(0x123, b"12345678"), [(0x123, b"12345678")]),
        (cobs_wire(0x123, b"123456789"), ["corrupt"]),
        (cobs_wire(0x123, b"123", 1), ["corrupt"]),
        (cobs_wire(0x123, b"123", 0x100), ["corrupt"]),
        (13 * b"\x01" + b"\0", ["corrupt"]),
        (14 * b"\x01" + b"\0", ["corrupt"]),
        (1000 * b"\x01" + b"\0" + cobs_wire(1, b"a"), ["corrupt", (1, b"a")]),
        (1000 * b"\x01", []),
    ],
)
def test_what_is_no_cobs_frame(core: Core, data: bytes, made: list[Any]) -> None:
    assert Receiver(core, "cobs").feed(data) == made


def test_cobs_takes_no_other_decoding_than_the_reference(core: Core) -> None:
    rng = random.Random(4)
    for _ in range(3000):
        number, payload = _random_frame(rng)
        data = bytearray(cobs_wire(number, payload)[:-1])
        data[rng.randrange(len(data))] = rng.randrange(1, 15)
        expected: Any = "corrupt"
        body = unstuff(bytes(data))
        right = 5 <= len(body) <= 12 and fastcrc.crc16.ibm_3740(body[:-2]) == int.from_bytes(
            body[-2:], "little"
        )
        if right and body[1] < 8:
            expected = (int.from_bytes(body[:2], "little"), body[2:-2])
        assert Receiver(core, "cobs").feed(bytes(data) + b"\0") == [expected]


def test_slcan_both_ways(core: Core) -> None:
    rng = random.Random(5)
    receiver = Receiver(core, "slcan")
    for _ in range(2000):
        number, payload = _random_frame(rng)
        line = slcan_wire(number, payload)
        out = core.new("uint8_t[22]")
        size = core.lib.dcmp_slcan_send(core.frame(number, payload), out)
        assert bytes(out[0:size]) == line
        assert receiver.feed(line) == [(number, payload)]


ANSWERED: list[tuple[bytes, list[Any]]] = [
    *[(line, [CR]) for line in (b"C", b"O", b"L", b"S6", b"s031C", b"s0123AB")],
    (b"V", [b"V0101\r"]),
    (b"N", [b"NDCMP\r"]),
    (b"F", [b"F00\r"]),
    (b"", []),
    (b"t0102AB0C", [(0x010, b"\xab\x0c")]),
    (b"t7FF80011223344556677", [(0x7FF, bytes.fromhex("0011223344556677"))]),
    *[(line, []) for line in (b"T1FFFFFFF0", b"T000000001AB", b"T000000008" + b"0" * 16)],
    *[(line, []) for line in (b"r1230", b"r7FF8", b"R000000008", b"R1FFFFFFF0")],
]
REFUSED = [
    *b"X CC O1 S SA S66 S/ s s123 s12345 s123456G s123G s12345678 V1 N0 F0 t".split(),
    *b"t010 t0100 t0109000000000000000000 t0102AB0 t0102AB0CD t0102ab0C t8001AA tF001AA tG001AA".split(),
    *b"t0:01AA t0/01AA t0@01AA t0001aA T200000000 T0000000 T000000009000000000000000000".split(),
    *b"T000000001A r1239 r12301 r8000 R0000000G0 R0000000 R00000000A R2000000000".split(),
    *(b"L ", b"\n", b"t0001A\xc1", b"t 001AA", b"\xff", b"\x80C", b"C\x80", b"t0102AB0C "),
    *(b"t" * 31, b"t" * 32, b"t" * 5000),
]


@pytest.mark.parametrize(("line", "made"), ANSWERED)
def test_slcan_lines(core: Core, line: bytes, made: list[Any]) -> None:
    assert Receiver(core, "slcan").feed(line + CR) == made


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_no_slcan_line(core: Core, line: bytes) -> None:
    receiver = Receiver(core, "slcan")
    assert receiver.feed(line + CR + b"t0102AB0C\r") == ["corrupt", (0x010, b"\xab\x0c")]
    assert receiver.feed(line + CR) == ["corrupt"]
    assert bytes(receiver.state.reply[0 : receiver.state.reply_length]) == BEL
