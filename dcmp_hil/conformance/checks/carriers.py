"""Section 3: damage on a serial line, and the commands of slcan."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.checks.frames import COUNTER_MAX
from dcmp_hil.conformance.lines import CobsLine, SlcanLine
from dcmp_hil.conformance.terms import COBS, SLCAN
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Hello, Identity, State, Stop
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client


def _counted(client: Client, before: int, expected: int, what: str) -> Iterator[str]:
    grown = client.health().crc_errors - before
    if before + expected < COUNTER_MAX and grown != expected:
        yield f"{what}: {expected} corrupt frames were sent, HEALTH.crc_errors grew by {grown}"


def _still_hears(client: Client, after: str) -> Iterator[str]:
    if client.hello() is None:
        yield f"after {after} a HELLO is not answered"
    if client.state == State.FAULT:
        yield f"after {after} the device is in FAULT: damage was taken for a STOP"


def _stuffed(body: bytes) -> bytes:
    data = body + struct.pack("<H", crc_hqx(body, 0xFFFF))
    return b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0")) + b"\0"


def cobs_damage(client: Client) -> Iterator[str]:
    """Send what is no COBS frame; each piece is one corrupt frame, and the next frame is heard again."""
    line = client.line
    assert isinstance(line, CobsLine)  # noqa: S101 - the runner goes by `carriers`
    number, data = pack(Stop(0), client.node)
    whole = cobs.encode((number, data))
    body = struct.pack("<H", number) + data
    pieces = {
        "a wrong crc16": whole[:-2] + bytes([whole[-2] ^ 0x40]) + b"\0",
        "a distance that leads out of the frame": b"\x05\x11\0",
        "more than 13 bytes": b"\x01" * 40 + b"\0",
        "more than 13 bytes, a STOP at their end": b"\x11" * 30 + whole,
        "an identifier above 7FF": _stuffed(struct.pack("<H", 0x800 | number) + data),
        "fewer than 5 bytes": _stuffed(struct.pack("<H", number)),
    }
    for what, piece in pieces.items():
        before = client.health().crc_errors
        line.write(piece)
        yield from _still_hears(client, what)
        yield from _counted(client, before, 1, what)
    before = client.health().crc_errors
    line.write(b"\0\0\0")
    line.write(_stuffed(body[:2] + b"\0\0\0"))  # a STOP of a wrong length: ignored
    yield from _still_hears(client, "empty frames")
    yield from _counted(client, before, 0, "empty frames and one of another length are no errors")


def split_frames(client: Client) -> Iterator[str]:
    """Send a frame byte by byte, and two frames in one write."""
    line = client.line
    assert isinstance(line, CobsLine | SlcanLine)  # noqa: S101 - the runner goes by `carriers`
    encode = cobs.encode if isinstance(line, CobsLine) else slcan.encode
    hello = encode(pack(Hello(0, PROTOCOL_HASH), client.node))
    at = len(client.heard)
    for byte in hello:
        line.write(bytes([byte]))
        client.listen()
    client.settled_state()
    came = sum(isinstance(message, Identity) for message in client.heard[at:])
    if came != 1:
        yield f"a HELLO whose bytes came one by one, a period apart, was answered {came} times"
    at = len(client.heard)
    line.write(2 * hello)
    client.settled_state()
    came = sum(isinstance(message, Identity) for message in client.heard[at:])
    if came != 2:  # noqa: PLR2004 - two were sent
        yield f"two HELLOs in one write were answered {came} times"


_COMMANDS = {
    b"O": b"",
    b"L": b"",
    b"S8": b"",
    b"s031C": b"",
    b"s00031C": b"",
    b"V": b"V0101",
    b"N": b"NDCMP",
    b"F": b"F00",
}


def slcan_commands(client: Client) -> Iterator[str]:
    """Send each slcan command and compare its answer."""
    for command, answer in _COMMANDS.items():
        said = _said(client, command)
        if said != [answer]:
            yield f"{command.decode()} was answered by {said}, the page says {answer!r} and CR"
    if said := _said(client, b""):
        yield f"an empty line was answered by {said}"
    line = client.line
    assert isinstance(line, SlcanLine)  # noqa: S101 - the runner goes by `carriers`
    line.write(b"C\r")
    client.clock.sleep_until_ns(client.clock.now_ns() + 20_000_000)
    client.drain()
    mark = len(client.samples)
    _let_pass(client, 0.1)
    client.drain()
    if len(client.samples) > mark:
        yield f"after C {len(client.samples) - mark} SAMPLEs came: it sends no frames until it is opened"
    line.write(b"O\r")
    client.listen(2)


def _let_pass(client: Client, seconds: float) -> None:
    """Wait while the device is silent on purpose."""
    end_ns = client.clock.now_ns() + int(1e9 * seconds)
    while client.clock.now_ns() < end_ns:
        client.take(0.02)


def _said(client: Client, text: bytes) -> list[bytes]:
    """Return the answers to a line, as soon as a question behind it was answered."""
    line = client.line
    assert isinstance(line, SlcanLine)  # noqa: S101 - the runner goes by `carriers`
    client.drain()
    line.answers.clear()
    line.write(text + b"\r")
    client.hello()
    return list(line.answers)


def slcan_lines(client: Client) -> Iterator[str]:
    """Send lines that are no frame, and frames that are none of this protocol."""
    number, data = pack(Stop(0), client.node)
    stop = slcan.encode((number, data))[:-1]
    bad = {
        "lower-case hex": stop[:5] + b"aa"[: len(stop) - 5] + b"bb",
        "a length that is not its own": stop[:4] + b"3" + stop[5:],
        "t with length 0": stop[:4] + b"0",
        "t with length 9": stop[:4] + b"9" + 9 * b"00",
        "an identifier above 7FF": b"t8001AA",
        "a letter that is no command": b"X",
        "S without a digit": b"S",
        "a byte above 0x7F": stop[:5] + b"\xc1A" + stop[7:],
        "more than 31 bytes": 40 * b"V",
        "r with two digits": b"r01",
    }
    for what, text in bad.items():
        before = client.health().crc_errors
        if (said := _said(client, text)) != [b"\a"]:
            yield f"{what} ({text[:12]!r}) was answered by {said}, the page says BEL"
        yield from _still_hears(client, what)
        yield from _counted(client, before, 1, what)
    before = client.health().crc_errors
    for text in (b"t7FF8" + 8 * b"00", b"t7FF1AA", b"T000000102AABB", b"T000000100", b"r0102", b"R000000100"):
        if said := _said(client, text):
            yield f"{text!r} is well formed and was answered by {said}"
    yield from _counted(client, before, 0, "well-formed frames of others are no errors")


CHECKS = (
    DeviceCheck(
        "cobs-damage",
        "3",
        "What is no frame is one corrupt frame up to its 0x00; the next frame is heard.",
        cobs_damage,
        carriers=(COBS,),
    ),
    DeviceCheck(
        "split-frames",
        "3",
        "Frames are found however the line cuts their bytes.",
        split_frames,
        carriers=(COBS, SLCAN),
    ),
    DeviceCheck(
        "slcan-commands",
        "3",
        "C, O, L, S, s, V, N, F are answered as the table says.",
        slcan_commands,
        carriers=(SLCAN,),
    ),
    DeviceCheck(
        "slcan-lines",
        "3",
        "A line that is not exactly as the table says is one corrupt frame, answered by BEL.",
        slcan_lines,
        carriers=(SLCAN,),
    ),
)
