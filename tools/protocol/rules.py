"""Rules of messages and fields; each refusal says what to write instead."""

from __future__ import annotations

import keyword
import re
from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING

from tools.protocol.dbc import attribute
from tools.protocol.statements import DbcError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cantools.database.can import Database, Message, Signal

_LENGTHS = range(2, 9)  # bytes: a field and the crc8 at least, a classic CAN frame at most
_OTHER_SIDE = {"HOST": "DEVICE", "DEVICE": "HOST"}
_FIELD_NAME, _CONSTANT_NAME = (
    re.compile(r"[a-z](?:\w*[A-Za-z0-9])?", re.ASCII),
    re.compile(r"[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)*"),
)
_KINDS = {
    "PythonClass": (re.compile(r"[A-Z]\w*", re.ASCII), "SampleReport"),
    "CStruct": (re.compile(r"dcmp_[a-z0-9_]+"), "dcmp_edge_stamp"),
}
"""Forms of the names that a message may give its class and its structure."""
_UNIT = re.compile(r"[\w%/^ .-]*")
_OF_C = re.compile(
    "auto|bool|break|case|char|const|continue|default|do|double|else|enum|extern|false|float|for|goto|if|inline|"
    "int|long|register|restrict|return|short|signed|sizeof|static|struct|switch|true|typedef|union|unsigned|"
    "void|volatile|while"
)
_OF_THE_CODE = re.compile(r"make|shared_\d+")
"""Names that the generated code gives itself."""


def check(database: Database) -> None:
    """Compare messages and fields with the rules, but for their enumerations.

    Raises
    ------
    DbcError
        If one breaks a rule.
    """
    for message in database.messages:
        _check_names(message)
        _check_message(message)
        for signal in message.signals:
            _check_field(f"{message.name}.{signal.name}", signal)
            _check_bounds(f"{message.name}.{signal.name}", signal)
            _check_values(f"{message.name}.{signal.name}", signal)


def _check_names(message: Message) -> None:
    name = message.name
    if not _CONSTANT_NAME.fullmatch(name):
        raise DbcError(f"{name}: a message's name has capitals, digits and single _, as in PARAMETER_SET")
    for kind, (form, example) in _KINDS.items():
        if (given := attribute(message, kind)) and not form.fullmatch(given):
            raise DbcError(f"{name}: its {kind} is {given!r}; write it as in {example}")


def _check_message(message: Message) -> None:
    name = message.name
    if message.length not in _LENGTHS:
        raise DbcError(
            f"{name} has {message.length} bytes; it may have {_LENGTHS[0]} to {_LENGTHS[-1]}, with its crc8: "
            "correct the length, or divide the message"
        )
    if message.senders not in ([side] for side in _OTHER_SIDE):
        raise DbcError(f"{name}: its sender is HOST or DEVICE, not {' and '.join(message.senders) or 'none'}")
    if not message.comment:
        raise DbcError(f'{name} has no comment; say when it is sent: CM_ BO_ {message.frame_id} "...";')
    sender, other = message.senders[0], _OTHER_SIDE[message.senders[0]]
    for signal in message.signals:
        if signal.receivers != [other]:
            raise DbcError(f"{name}.{signal.name}: {sender} sends it, so that its receiver is {other}")
    _check_places(message)


def _check_places(message: Message) -> None:
    """Refuse fields that overlap, that end behind the payload, or whose crc8 is not its last byte."""
    name, placed = message.name, sorted(message.signals, key=lambda signal: signal.start)
    for signal in placed:
        if signal.byte_order != "little_endian":
            raise DbcError(f"{name}.{signal.name} is not little-endian; write @1, and its lowest bit")
    for one, other in pairwise(placed):
        if one.start + one.length > other.start:
            free = one.start + one.length
            raise DbcError(
                f"{name}: {one.name} and {other.name} overlap; {other.name} can begin at bit {free}"
            )
    for one in placed:
        if one.start + one.length > 8 * message.length:
            raise DbcError(
                f"{name}.{one.name} ends behind the message's {message.length} bytes; lengthen the message"
            )
    last = 8 * message.length - 8
    crc = [(one.name, one.start, one.length, one.is_signed, bool(one.choices)) for one in placed[-1:]]
    if crc != [("crc8", last, 8, False, False)]:
        raise DbcError(
            f"{name}: its last byte is not its crc8; write SG_ crc8 : {last}|8@1+, without VAL_ rows"
        )


def _check_field(where: str, signal: Signal) -> None:
    name = signal.name
    if not _FIELD_NAME.fullmatch(name):
        raise DbcError(f"{where}: a field's name begins with a small letter, and does not end in _")
    if _OF_C.fullmatch(name) or keyword.iskeyword(name) or _OF_THE_CODE.fullmatch(name):
        raise DbcError(f"{where}: {name} is a word of C, of Python or of the generated code; rename it")
    if (signal.scale, signal.offset) != (1, 0):
        raise DbcError(
            f"{where} has a scale or an offset; write (1,0): the wire has integers, with their unit"
        )
    if not _UNIT.fullmatch(signal.unit or ""):
        raise DbcError(
            f"{where}: its unit {signal.unit!r} has other signs than letters, digits and % / ^ . -"
        )


def _check_bounds(where: str, signal: Signal) -> None:
    least = -(1 << signal.length - 1) if signal.is_signed else 0
    most = least + (1 << signal.length) - 1
    if signal.minimum is None or signal.maximum is None:
        raise DbcError(f"{where} has no bounds; write [{least}|{most}], or what it may be of that")
    if signal.minimum != int(signal.minimum) or signal.maximum != int(signal.maximum):
        raise DbcError(f"{where} has bounds that are no integers, and would be cut; write integers")
    if not least <= signal.minimum <= signal.maximum <= most:
        raise DbcError(
            f"{where}: its bounds are not within {least}..{most}, which its bits can be; correct them"
        )


def _check_values(where: str, signal: Signal) -> None:
    if signal.choices and signal.length == 1:
        raise DbcError(f"{where} is one bit, a bool without names; remove its VAL_ rows, or give it 2 bits")
    for value, name in (signal.choices or {}).items():
        if not _CONSTANT_NAME.fullmatch(str(name)):
            raise DbcError(f"{where}: VAL_ {value} {name}: a value's name has capitals, digits and single _")
        if not int(signal.minimum or 0) <= value <= int(signal.maximum or 0):
            raise DbcError(f"{where}: VAL_ {value} {name} is outside its bounds; renumber it, or widen them")


def check_once(what: str, names: Iterable[str]) -> None:
    """Refuse names that stand twice.

    Raises
    ------
    DbcError
        If one does.
    """
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:
        raise DbcError(f"two {what} have one name: {', '.join(twice)}; rename one")
