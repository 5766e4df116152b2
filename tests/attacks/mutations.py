"""Recordings that were damaged: one blow each, of every kind that disks, cables and people deal."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import random
    from collections.abc import Callable

_HEAD = struct.Struct("<BQ")
_MAGIC = 8


class Mutant(NamedTuple):
    """A recording with one mutation.

    Parameters
    ----------
    kind
        Of the blow.
    content
        The file.
    """

    kind: str
    content: bytes


def records(content: bytes) -> list[tuple[int, int, int]]:
    """Return opcode, beginning and end of each record of a whole file."""
    found, at = [], _MAGIC
    while at < len(content) - _MAGIC:
        opcode, length = _HEAD.unpack_from(content, at)
        found.append((opcode, at, at + _HEAD.size + length))
        at += _HEAD.size + length
    return found


def mutant(content: bytes, other: bytes, chance: random.Random) -> Mutant:
    """Return a recording with one random mutation.

    Parameters
    ----------
    content
        A whole recording.
    other
        Another one, for what is mixed up.
    chance
        Chooses.
    """
    kind = chance.choice(sorted(KINDS))
    return Mutant(kind, KINDS[kind](content, other, chance))


def _bit(content: bytes, _: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(content))
    return content[:at] + bytes([content[at] ^ 1 << chance.randrange(8)]) + content[at + 1 :]


def _byte(content: bytes, _: bytes, chance: random.Random) -> bytes:
    made = bytearray(content)
    for _n in range(chance.randint(1, 8)):
        made[chance.randrange(len(made))] = chance.randrange(256)
    return bytes(made)


def _hole(fill: bytes) -> Callable[[bytes, bytes, random.Random], bytes]:
    def dig(content: bytes, _: bytes, chance: random.Random) -> bytes:
        at = chance.randrange(len(content))
        length = min(chance.choice([1, 16, 512, 4096, 20_000]), len(content) - at)
        return content[:at] + fill * length + content[at + length :]

    return dig


def _cut(content: bytes, _: bytes, chance: random.Random) -> bytes:
    return content[: chance.randrange(len(content))]


def _cut_front(content: bytes, _: bytes, chance: random.Random) -> bytes:
    return content[chance.randrange(1, len(content)) :]


def _lost(content: bytes, _: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(content))
    return content[:at] + content[at + chance.choice([1, 2, 64, 512, 4096]) :]


def _inserted(content: bytes, _: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(content))
    return content[:at] + chance.randbytes(chance.choice([1, 2, 64, 512, 4096])) + content[at:]


def _swapped(content: bytes, _: bytes, chance: random.Random) -> bytes:
    """Exchange two sectors."""
    size = chance.choice([512, 4096])
    first, second = sorted(chance.sample(range(len(content) // size), 2))
    a, b = first * size, second * size
    return (
        content[:a]
        + content[b : b + size]
        + content[a + size : b]
        + content[a : a + size]
        + content[b + size :]
    )


def _doubled(content: bytes, _: bytes, chance: random.Random) -> bytes:
    """Return the content with one sector copied over another."""
    size = chance.choice([512, 4096])
    a, b = (size * chance.randrange(len(content) // size) for _n in range(2))
    return content[:b] + content[a : a + size] + content[b + size :]


def _record(change: str) -> Callable[[bytes, bytes, random.Random], bytes]:
    """Change whole records, each with its right checksum."""

    def do(content: bytes, other: bytes, chance: random.Random) -> bytes:
        parts = [content[start:end] for _, start, end in records(content)]
        at = chance.randrange(1, len(parts) - 1)
        if change == "gone":
            del parts[at]
        elif change == "twice":
            parts.insert(chance.randrange(1, len(parts) - 1), parts[at])
        elif change == "moved":
            parts.insert(chance.randrange(1, len(parts) - 1), parts.pop(at))
        elif change == "renamed":
            parts[at] = bytes([chance.randrange(256)]) + parts[at][1:]
        elif change == "foreign":
            foreign = records(other)
            _, start, end = foreign[chance.randrange(1, len(foreign) - 1)]
            parts[at] = other[start:end]
        return content[:_MAGIC] + b"".join(parts) + content[-_MAGIC:]

    return do


def _length(content: bytes, _: bytes, chance: random.Random) -> bytes:
    """Let a record say another length."""
    _opcode, at, end = chance.choice(records(content))
    said = chance.choice([0, 1, end - at, 2**31, 2**63, 2**64 - 1, chance.randrange(len(content))])
    return content[: at + 1] + struct.pack("<Q", said) + content[at + _HEAD.size :]


def _joined(content: bytes, other: bytes, chance: random.Random) -> bytes:
    """Put two recordings behind one another, or one behind itself."""
    return content + chance.choice([content, other, content[chance.randrange(len(content)) :]])


KINDS: dict[str, Callable[[bytes, bytes, random.Random], bytes]] = {
    "bit": _bit,
    "bytes": _byte,
    "hole of 00": _hole(b"\0"),
    "hole of ff": _hole(b"\xff"),
    "cut": _cut,
    "front cut": _cut_front,
    "bytes lost": _lost,
    "bytes inserted": _inserted,
    "sectors swapped": _swapped,
    "sector doubled": _doubled,
    "record gone": _record("gone"),
    "record twice": _record("twice"),
    "record moved": _record("moved"),
    "record renamed": _record("renamed"),
    "record foreign": _record("foreign"),
    "length wrong": _length,
    "joined": _joined,
}
