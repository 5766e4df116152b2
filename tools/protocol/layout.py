"""Layouts of the DBC's messages: fields, and the words of the payload that contain them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

MARK = "Generated from firmware/proto/dcmp.dbc; `make generate` writes it."
_WHOLE_WORDS = {(1, False), (2, False), (3, False), (4, False), (1, True), (2, True), (4, True)}
_SHARED_BYTES = {1, 2, 4}
_SPLIT_BYTES = 3


@dataclass(frozen=True)
class Enumeration:
    """Named values of a field.

    Attributes
    ----------
    python, c : str
        Its name in Python (with a module in front: it is not generated) and in C; empty if it has none there.
    comment : str
        The field's comment.
    values : dict of str to int
        In the order of their numbers.
    """

    python: str
    c: str
    comment: str
    values: dict[str, int]


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
    ValueError
        If a message has a layout that the generators do not know: which one, and why.
    """
    enumerations = _enumerations(database)
    return [_layout(message, enumerations) for message in database.messages]


def enumerations_of(found: list[Layout]) -> list[Enumeration]:
    """Return the enumerations of some messages, each once."""
    every = [field.enumeration for layout in found for field in layout.fields if field.enumeration]
    return [one for at, one in enumerate(every) if one not in every[:at]]


def _layout(message: Message, enumerations: list[Enumeration]) -> Layout:
    *signals, crc = sorted(message.signals, key=lambda signal: signal.start)
    if (crc.name, crc.start, crc.length) != ("crc8", 8 * message.length - 8, 8):
        raise ValueError(f"{message.name}: its last byte is not its crc8")
    by_name = {signal.name: _field(message, signal, enumerations) for signal in signals}
    return Layout(
        name=message.name,
        identifier=message.frame_id,
        length=message.length,
        from_host=message.senders == ["HOST"],
        comment=message.comment or "",
        python=_attribute(message, "PythonClass") or message.name.title().replace("_", ""),
        c=_attribute(message, "CStruct") or f"dcmp_{message.name.lower()}",
        fields=tuple(by_name[name] for name in _order(signals)),
        words=tuple(_words(message.name, list(by_name.values()))),
    )


def _order(signals: list[Signal]) -> list[str]:
    """Return the names in the order of the structures: that of the payload but for `PlacedBefore`."""
    names = [signal.name for signal in signals]
    for signal in signals:
        if before := _attribute(signal, "PlacedBefore"):
            names.remove(signal.name)
            names.insert(names.index(before), signal.name)
    return names


def _field(message: Message, signal: Signal, enumerations: list[Enumeration]) -> Field:
    where = f"{message.name}.{signal.name}"
    if signal.byte_order != "little_endian":
        raise ValueError(f"{where} is not little-endian")
    if (signal.scale, signal.offset) != (1, 0):
        raise ValueError(f"{where} has a scale or an offset; the wire has integers, with their unit")
    if signal.minimum is None or signal.maximum is None:
        raise ValueError(f"{where} has no bounds")
    values = _values(signal)
    return Field(
        name=signal.name,
        bit=signal.start,
        bits=signal.length,
        signed=signal.is_signed,
        least=int(signal.minimum),
        most=int(signal.maximum),
        unit=signal.unit or "",
        comment=signal.comment or "",
        enumeration=next((one for one in enumerations if values and one.values == values), None),
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
    for word in words:
        _check(name, word)
    return words


def _check(name: str, word: Word) -> None:
    where = f"{name}: {', '.join(field.name for field in word.fields)}"
    if not word.shared:
        if (word.bytes, word.fields[0].signed) not in _WHOLE_WORDS:
            raise ValueError(f"{where}: a signed field has 8, 16 or 32 bits")
    elif word.bytes not in _SHARED_BYTES:
        raise ValueError(f"{where}: fields share 1, 2 or 4 bytes, not {word.bytes}")
    elif any(field.signed for field in word.fields):
        raise ValueError(f"{where}: a signed field shares no byte")


def _enumerations(database: Database) -> list[Enumeration]:
    return [
        Enumeration(python, c, signal.comment or "", _values(signal))
        for message in database.messages
        for signal in message.signals
        if (python := _attribute(signal, "PythonEnum")) + (c := _attribute(signal, "CEnum"))
    ]


def _values(signal: Signal) -> dict[str, int]:
    return {str(name): int(value) for value, name in sorted((signal.choices or {}).items())}


def _attribute(of: Message | Signal, name: str) -> str:
    """Return an attribute of the DBC; empty if it is not set."""
    attributes: dict[str, Any] = of.dbc.attributes if of.dbc else {}
    return str(attributes[name].value) if name in attributes else ""
