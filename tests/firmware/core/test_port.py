"""Bytes in, bytes out, with a device behind."""

from typing import Any

import pytest

from tests.firmware.bench import Bench, Core, cobs_wire, decode, encode, slcan_wire, unstuff

COBS, SLCAN = 0, 1


class Port:
    """A port, and the bench of its device."""

    def __init__(self, core: Core, carrier: int) -> None:
        self.core = core
        self.bench = Bench(core)
        self.carrier = carrier
        self.port = core.new("struct dcmp_port *")
        core.lib.dcmp_port_init(self.port, carrier)

    def receive(self, data: bytes, room: int = 64) -> bytes:
        out: Any = self.core.new("uint8_t[]", room) if room else self.core.ffi.NULL
        size = self.core.lib.dcmp_port_receive(
            self.port, self.bench.device, data, len(data), self.bench.now, out, room
        )
        return bytes(out[0:size]) if size else b""

    def transmit(self, room: int = 256) -> bytes:
        out: Any = self.core.new("uint8_t[]", room) if room else self.core.ffi.NULL
        size = self.core.lib.dcmp_port_transmit(self.port, self.bench.device, out, room)
        return bytes(out[0:size]) if size else b""

    def wire(self, number: int, payload: bytes) -> bytes:
        return (cobs_wire, slcan_wire)[self.carrier](number, payload)

    def hello(self) -> bytes:
        return self.wire(*encode("HELLO", session=77, protocol_hash=self.core.lib.check_protocol_hash()))


@pytest.mark.parametrize("carrier", [COBS, SLCAN])
def test_a_question_and_its_answer(core: Core, carrier: int) -> None:
    port = Port(core, carrier)
    assert port.receive(port.hello()) == b""
    assert port.bench.device.session.owner == 77
    (name, fields) = _read(port, port.transmit())
    assert (name, fields["owned"]) == ("IDENTITY", 1)


def _read(port: Port, data: bytes) -> tuple[str, dict[str, Any]]:
    if port.carrier == COBS:
        body = unstuff(data[:-1])
        return decode(int.from_bytes(body[:2], "little"), body[2:-2])
    line = data.decode()
    return decode(int(line[1:4], 16), bytes.fromhex(line[5:-1]))


@pytest.mark.parametrize("carrier", [COBS, SLCAN])
def test_corrupt_bytes_reach_the_device(core: Core, carrier: int) -> None:
    port = Port(core, carrier)
    end = b"\r" if carrier else b"\0"
    assert port.receive(b"garbage" + end) == (b"\x07" if carrier else b"")
    assert port.bench.device.health.report.crc_errors == 1
    port.receive(b"garbage" * 20 + end + port.hello())
    assert port.bench.device.health.report.crc_errors == 2
    assert port.bench.device.session.owner == 77


def test_slcan_answers(core: Core) -> None:
    port = Port(core, SLCAN)
    assert port.receive(b"V\rN\r\rF\rO\rS6\rX\rr1230\r") == b"V0101\rNDCMP\rF00\r\r\r\x07"
    assert port.receive(b"V\rN\r", room=6) == b"V0101\r"
    assert port.receive(b"V\rC\r", room=5) == b"\r"
    assert port.receive(b"V\rX\r", room=0) == b""


def test_a_closed_slcan_port_receives_but_sends_nothing(core: Core) -> None:
    port = Port(core, SLCAN)
    port.receive(b"C\r" + port.hello())
    assert port.bench.device.session.owner == 77
    assert port.transmit() == b""
    for command in (b"O\r", b"L\r"):
        port.receive(b"C\r" + port.hello())
        assert port.transmit() == b""
        port.receive(command)
        assert port.transmit() == b""
        port.receive(port.hello())
        assert port.transmit() != b""


@pytest.mark.parametrize("carrier", [COBS, SLCAN])
def test_whole_frames_only(core: Core, carrier: int) -> None:
    port = Port(core, carrier)
    longest = 22 if carrier else 14
    for _ in range(3):
        port.receive(port.hello())
    for room in (0, 1, longest - 1):
        assert port.transmit(room) == b""
    for _ in range(3):
        assert _read(port, port.transmit(longest))[0] == "IDENTITY"
    assert port.transmit() == b""
