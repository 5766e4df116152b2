"""Layouts of the DBC's messages: fields, and the words of the payload that contain them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tools.protocol import rules
from tools.protocol.dbc import attribute
from tools.protocol.enumerations import Enumeration, enumerations
from tools.protocol.statements import DbcError

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

MARK = "Generated from firmware/proto/dcmp.dbc; `make generate` writes it."
_WHOLE_WORDS = {(1, False), (2, False), (3, False), (4, False), (1, True), (2, True), (4, True)}
_SHARED_BYTES = {1, 2, 4}
_SPLIT_BYTES = 3
_PYTHON_CLASSES = ("Any", "Callable", "IntEnum", "Message", "MessageLayout", "NamedTuple", "Struct")
"""Classes that the generated modules have already."""


@dataclass(frozen=True)
class Field:
    """A field of a message: `bits` bits from bit `bit` of the payload on, `least` to `most` in `unit`."""

    name: str
    bit: int
    bits: int
    signed: bool
    least: int
    most: int
    unit: str
    comment: str
    enumeration: Enumeration | None

    @property
    def flag(self) -> bool:
        """Whether it is one bit, a bool."""
        return self.bits == 1


@dataclass(frozen=True)
class Word:
    """Whole bytes of a payload that belong to one field, or to several."""

    byte: int
    bytes: int
    fields: tuple[Field, ...]

    @property
    def shared(self) -> bool:
        """Whether it is more than one whole field."""
        return len(self.fields) > 1 or self.fields[0].bits != 8 * self.bytes

    @property
    def split(self) -> bool:
        """Whether `struct` has no code for it, and it is read in two parts."""
        return self.bytes == _SPLIT_BYTES

    def shift(self, field: Field) -> int:
        """Return the place of a field's lowest bit in the word."""
        return field.bit - 8 * self.byte


@dataclass(frozen=True)
class Layout:
    """A message: its fields in the order of the structures, its words in the order of the payload."""

    name: str
    identifier: int  # of node 0
    length: int  # bytes, with the crc8
    from_host: bool
    comment: str
    python: str
    c: str
    fields: tuple[Field, ...]
    words: tuple[Word, ...]

    @property
    def summary(self) -> str:
        """The comment as it goes on after the message's name."""
        return self.comment[:1].lower() + self.comment[1:]

    def word(self, field: Field) -> Word:
        """Return the word that contains a field."""
        return next(word for word in self.words if field in word.fields)


def layouts(database: Database) -> list[Layout]:
    """Return the layouts of all messages.

    Raises
    ------
    DbcError
        If the generators would get a message wrong: which one, why, and what to write instead.
    """
    rules.check(database)
    of = enumerations(database)
    found = [_layout(message, of) for message in database.messages]
    rules.check_once("classes of Python", [*_PYTHON_CLASSES, *_python_names(found)])
    rules.check_once("structures or enumerations of C", _c_names(found))
    return found


def enumerations_of(found: list[Layout]) -> list[Enumeration]:
    """Return the enumerations of some messages, each once."""
    every = [field.enumeration for layout in found for field in layout.fields if field.enumeration]
    return [one for at, one in enumerate(every) if one not in every[:at]]


def _python_names(found: list[Layout]) -> list[str]:
    made = [one.python for one in enumerations_of(found) if one.python and "." not in one.python]
    return [*made, *(layout.python for layout in found)]


def _c_names(found: list[Layout]) -> list[str]:
    return [*(one.c for one in enumerations_of(found) if one.c), *(layout.c for layout in found)]


def _layout(message: Message, of: dict[str, Enumeration]) -> Layout:
    *signals, _ = sorted(message.signals, key=lambda signal: signal.start)
    by_name = {signal.name: _field(signal, of.get(f"{message.name}.{signal.name}")) for signal in signals}
    return Layout(
        name=message.name,
        identifier=message.frame_id,
        length=message.length,
        from_host=message.senders == ["HOST"],
        comment=message.comment or "",
        python=attribute(message, "PythonClass") or message.name.title().replace("_", ""),
        c=attribute(message, "CStruct") or f"dcmp_{message.name.lower()}",
        fields=tuple(by_name[name] for name in _order(message.name, signals)),
        words=tuple(_words(message.name, list(by_name.values()))),
    )


def _order(message: str, signals: list[Signal]) -> list[str]:
    """Return the names in the order of the structures: that of the payload but for `PlacedBefore`."""
    names = [signal.name for signal in signals]
    for signal in signals:
        if before := attribute(signal, "PlacedBefore"):
            if before == signal.name or before not in names:
                raise DbcError(f"{message}.{signal.name}: PlacedBefore is another field of it, not {before}")
            names.remove(signal.name)
            names.insert(names.index(before), signal.name)
    return names


def _field(signal: Signal, enumeration: Enumeration | None) -> Field:
    return Field(
        name=signal.name,
        bit=signal.start,
        bits=signal.length,
        signed=signal.is_signed,
        least=int(signal.minimum or 0),
        most=int(signal.maximum or 0),
        unit=signal.unit or "",
        comment=signal.comment or "",
        enumeration=enumeration,
    )


def _words(name: str, fields: list[Field]) -> list[Word]:
    """Group fields that have a byte in common."""
    words: list[Word] = []
    for field in fields:
        first, last = field.bit // 8, (field.bit + field.bits - 1) // 8
        if words and first < words[-1].byte + words[-1].bytes:
            start = words[-1].byte
            words[-1] = Word(start, max(last + 1 - start, words[-1].bytes), (*words[-1].fields, field))
        else:
            words.append(Word(first, last + 1 - first, (field,)))
    names = {field.name for field in fields}
    for word in words:
        _check(name, word)
        halves = {f"{word.fields[0].name}_{half}" for half in ("low", "high")} if word.split else set()
        if taken := halves & names:
            raise DbcError(f"{name}: {', '.join(taken)} is a half of {word.fields[0].name}; rename it")
    return words


def _check(name: str, word: Word) -> None:
    where = f"{name}: {', '.join(field.name for field in word.fields)}"
    if not word.shared:
        if (word.bytes, word.fields[0].signed) not in _WHOLE_WORDS:
            raise DbcError(f"{where}: a field of whole bytes has 8, 16 or 32 bits, or 24 unsigned ones")
    elif word.bytes not in _SHARED_BYTES:
        raise DbcError(
            f"{where}: fields share 1, 2 or 4 bytes, not {word.bytes}; begin one at a byte's lowest bit"
        )
    elif any(field.signed for field in word.fields):
        raise DbcError(
            f"{where}: a signed field shares no byte; give it 8, 16 or 32 bits from a byte's lowest on"
        )
