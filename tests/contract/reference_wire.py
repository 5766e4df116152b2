"""Checksums, frames, carriers and the encoder as docs/protocol.md alone describes them."""

from __future__ import annotations

import hashlib
import re
import struct
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

Frame = tuple[int, bytes]
"""Identifier and payload, crc8 included."""

STOP, DRIVE, FAULT, SAMPLE, EDGE, HELLO, IDENTITY, GET, SET, VALUE, HEALTH = range(1, 12)
LENGTHS = dict(zip(range(1, 12), (2, 8, 7, 8, 8, 7, 8, 2, 8, 7, 7), strict=True))
TO_DEVICE = (STOP, DRIVE, HELLO, GET, SET)

BOOT, IDLE, ARMING, RUN, FAULTED = range(5)
HOST_SILENT, LINK_DOWN, STOPPED, CORRUPT_LINK, OVER_SPEED, OVER_TRAVEL, ENCODER_JUMP = range(1, 8)
OK, UNKNOWN, READ_ONLY, OUT_OF_RANGE, NOT_IDLE, NOT_OWNER = range(6)
BOARD, BOOT_COUNT, RESET_CAUSE, TICK, COUNTS_PER_REV, PERIOD_US = range(1, 7)
VOLTAGE_LIMIT, SLEW, WATCHDOG, SPEED_LIMIT, TRAVEL_LIMIT, EDGE_STAMPS = range(7, 13)
LAST_FAULT, LAST_FAULT_DETAIL, SUPPLY, TRAVEL_ORIGIN = 13, 14, 15, 16

VALUE_MAX = 2**31 - 1
COBS_LONGEST = 13
SLCAN_LONGEST = 31

_HEX = "[0-9A-F]"
_COMMANDS = (
    (re.compile(r"[CLO]"), b"\r"),
    (re.compile(rf"S[0-9]|s{_HEX}{{4}}|s{_HEX}{{6}}"), b"\r"),
    (re.compile(r"V"), b"V0101\r"),
    (re.compile(r"N"), b"NDCMP\r"),
    (re.compile(r"F"), b"F00\r"),
    (re.compile(rf"r[0-7]{_HEX}{{2}}[0-8]|R[01]{_HEX}{{7}}[0-8]"), b""),
)
_DATA = re.compile(rf"t([0-7]{_HEX}{{2}})([1-8])((?:{_HEX}{{2}})+)")
_EXTENDED = re.compile(rf"T[01]{_HEX}{{7}}([0-8])((?:{_HEX}{{2}})*)")


def protocol_hash() -> int:
    """Return the first 4 bytes of the SHA-256 of the lines of the DBC file that lay messages out."""
    text = (Path(__file__).parents[2] / "firmware/proto/dcmp.dbc").read_text(encoding="utf-8")
    lines = [line.strip() for line in text.split("\n")]
    kept = "".join(f"{line}\n" for line in lines if line.startswith(("BO_ ", "SG_ ", "VAL_ ")))
    return int.from_bytes(hashlib.sha256(kept.encode()).digest()[:4], "big")


def _crc(data: bytes, *, bits: int, polynomial: int, start: int) -> int:
    top, mask, crc = 1 << (bits - 1), (1 << bits) - 1, start
    for byte in data:
        crc ^= byte << (bits - 8)
        for _ in range(8):
            crc = ((crc << 1) ^ (polynomial if crc & top else 0)) & mask
    return crc


def crc8(data: bytes) -> int:
    """CRC-8/AUTOSAR."""
    return _crc(data, bits=8, polynomial=0x2F, start=0xFF) ^ 0xFF


def crc16(data: bytes) -> int:
    """CRC-16/IBM-3740."""
    return _crc(data, bits=16, polynomial=0x1021, start=0xFFFF)


def frame(number: int, node: int, content: bytes) -> Frame:
    """Put the identifier in front of a payload, and crc8 behind it."""
    identifier = number * 16 + node
    return identifier, content + bytes([crc8(struct.pack("<H", identifier) + content)])


def intact(identifier: int, payload: bytes) -> bool:
    """Tell whether crc8 is right."""
    return crc8(struct.pack("<H", identifier) + payload[:-1]) == payload[-1]


def cobs_encode(data: bytes) -> bytes:
    """Stuff up to 253 bytes, without the 0x00 behind them."""
    return b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0"))


def cobs_decode(data: bytes) -> bytes | None:
    """Return the decoded bytes; None if they are no COBS."""
    parts, at = [], 0
    while at < len(data):
        part = data[at + 1 : at + data[at]]
        if data[at] == 0 or len(part) != data[at] - 1 or 0 in part:
            return None
        parts.append(part)
        at += data[at]
    return b"\0".join(parts)


class Line:
    """A stream of bytes cut at one ending byte. `feed` yields a frame, or None for a corrupt one."""

    end = 0
    longest = COBS_LONGEST

    def __init__(self) -> None:
        self.open = True  # frames may be sent
        self.answers = b""  # to commands, not yet sent
        self._line = bytearray()

    def feed(self, data: bytes) -> Iterator[Frame | None]:
        """Yield the frames in received bytes; None for a corrupt one."""
        for byte in data:
            if byte != self.end:
                self._line += bytes([byte])[: self.longest + 1 - len(self._line)]
                continue
            line = bytes(self._line)
            self._line.clear()
            yield from self.take(line)

    def take(self, line: bytes) -> Iterator[Frame | None]:
        """Read one line without its end, longer than `longest` if it was too long."""
        raise NotImplementedError

    def pack(self, frames: Iterable[Frame]) -> bytes:
        """Return the bytes of frames."""
        raise NotImplementedError


class Cobs(Line):
    """COBS with crc16."""

    def __init__(self) -> None:
        super().__init__()
        self._silent = True

    def take(self, line: bytes) -> Iterator[Frame | None]:
        if not line:
            return
        data = cobs_decode(line) if len(line) <= COBS_LONGEST else None
        if data is None or not 5 <= len(data) <= 12:
            yield None
            return
        identifier, check = struct.unpack("<H", data[:2])[0], struct.unpack("<H", data[-2:])[0]
        yield (identifier, data[2:-2]) if identifier < 0x800 and check == crc16(data[:-2]) else None

    def pack(self, frames: Iterable[Frame]) -> bytes:
        out = b""
        for identifier, payload in frames:
            data = struct.pack("<H", identifier) + payload
            out += cobs_encode(data + struct.pack("<H", crc16(data))) + b"\0"
        if out and self._silent:
            self._silent, out = False, b"\0" + out  # closes an unfinished frame before it
        return out


class Slcan(Line):
    """Lines of text, and the device's answers to commands."""

    end = 0x0D
    longest = SLCAN_LONGEST

    def take(self, line: bytes) -> Iterator[Frame | None]:
        text = line.decode("latin-1")
        if data := _DATA.fullmatch(text):
            if len(data[3]) == 2 * int(data[2]):
                yield int(data[1], 16), bytes.fromhex(data[3])
                return
        elif (extended := _EXTENDED.fullmatch(text)) and len(extended[2]) == 2 * int(extended[1]):
            return
        if text and not self._command(text):
            self.answers += b"\a"
            yield None

    def _command(self, text: str) -> bool:
        for pattern, answer in _COMMANDS:
            if pattern.fullmatch(text):
                self.open = text != "C" and (self.open or text in {"O", "L"})
                self.answers += answer
                return True
        return False

    def pack(self, frames: Iterable[Frame]) -> bytes:
        return "".join(f"t{i:03X}{len(data)}{data.hex().upper()}\r" for i, data in frames).encode()


class Outbox:
    """What waits to be sent: the newest of each periodic message, and up to 16 answers behind them."""

    def __init__(self) -> None:
        self.overruns = 0
        self.answers: list[tuple[int, bytes]] = []
        self._newest: dict[int, bytes] = {}

    def send(self, number: int, content: bytes) -> None:
        """Take the place of an older one of its kind."""
        self.overruns += number in self._newest
        self._newest[number] = content

    def answer(self, number: int, content: bytes) -> None:
        """Append an answer to the queue."""
        self.answers = [*self.answers, (number, content)][:16]

    def take(self) -> list[tuple[int, bytes]]:
        """Return the queued frames and clear the queue."""
        out = sorted(self._newest.items()) + self.answers
        self.answers, self._newest = [], {}
        return out


class Parameters:
    """The values of section 9."""

    def __init__(self, limits: dict[int, int], facts: dict[int, int]) -> None:
        self._built = limits | {EDGE_STAMPS: 0, TRAVEL_ORIGIN: -1}
        self.now = (
            {BOARD: 1, BOOT_COUNT: 0, RESET_CAUSE: 0, TICK: 0, LAST_FAULT: 0, LAST_FAULT_DETAIL: 0, SUPPLY: 0}
            | self._built
            | facts
        )
        self._highest = limits | {
            SLEW: limits[SLEW] or VALUE_MAX,
            EDGE_STAMPS: 0,  # no stamps here
            TRAVEL_ORIGIN: 2**24 - 1,
        }

    def restore(self) -> None:
        """Restore the parameters that a host changed."""
        self.now.update(self._built)

    def told(self, id_: int, result: int) -> bytes:
        """Return the content of PARAMETER_VALUE."""
        return struct.pack("<BiB", id_, self.now.get(id_, 0), result)

    def change(self, id_: int, value: int, *, idle: bool, owner: bool) -> int:
        """Execute PARAMETER_SET if it is allowed; return the result code."""
        lowest = {WATCHDOG: 5, EDGE_STAMPS: 0, TRAVEL_ORIGIN: -1}.get(id_, 1)
        reasons = (
            (UNKNOWN, id_ not in self.now),
            (READ_ONLY, id_ not in self._highest),
            (OUT_OF_RANGE, not lowest <= value <= self._highest.get(id_, 0)),
            (NOT_IDLE, not idle),
            (NOT_OWNER, not owner),
        )
        result = next((reason for reason, holds in reasons if holds), OK)
        if result == OK:
            self.now[id_] = value
        return result


LEASE_US = 500_000
ARMING_DRIVES = 10
LINES = {"cobs": Cobs, "slcan": Slcan, "can": Line}
