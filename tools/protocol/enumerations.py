"""Enumerations: which fields have one, and that the rows of one are the same in every place.

The DBC format has no rows that several fields refer to, so that a parameter's stand at three fields.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tools.protocol.dbc import attribute
from tools.protocol.statements import DbcError

if TYPE_CHECKING:
    from cantools.database.can import Database, Signal

_PYTHON_NAME = re.compile(r"(?:[a-z_]+\.)*[A-Z]\w*", re.ASCII)
_C_NAME = re.compile(r"dcmp_[a-z0-9_]+")


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


def enumerations(database: Database) -> dict[str, Enumeration]:
    """Return the enumeration of each field that has one, by `MESSAGE.field`.

    Raises
    ------
    DbcError
        If fields of one enumeration have different rows, or it does not follow which one a field has.
    """
    fields = {
        f"{message.name}.{signal.name}": signal for message in database.messages for signal in message.signals
    }
    _check_same_names(fields)
    named = {where: _named(where, signal) for where, signal in fields.items() if _names(signal)}
    _check_named_once(named)
    of = {where: named.get(where) or _matching(where, signal, named) for where, signal in fields.items()}
    return {where: one for where, one in of.items() if one}


def _names(signal: Signal) -> str:
    return attribute(signal, "PythonEnum") + attribute(signal, "CEnum")


def _values(signal: Signal) -> dict[str, int]:
    return {str(name): int(value) for value, name in sorted((signal.choices or {}).items())}


def _named(where: str, signal: Signal) -> Enumeration:
    python, c = attribute(signal, "PythonEnum"), attribute(signal, "CEnum")
    if (python and not _PYTHON_NAME.fullmatch(python)) or (c and not _C_NAME.fullmatch(c)):
        raise DbcError(f"{where}: name its enumeration as in StopReason (Python) and dcmp_state (C)")
    if not signal.choices:
        raise DbcError(f"{where} names an enumeration, and has no values; write its VAL_ rows")
    if not signal.comment:
        raise DbcError(f"{where} names an enumeration, and has no comment, which is that of the enumeration")
    if attribute(signal, "NoEnum"):
        raise DbcError(f"{where} names an enumeration, and has NoEnum; remove one")
    return Enumeration(python, c, signal.comment, _values(signal))


def _check_same_names(fields: dict[str, Signal]) -> None:
    """Refuse fields of one name whose rows differ: one was changed, and another was not."""
    first: dict[str, str] = {}
    for where, signal in fields.items():
        other = first.setdefault(signal.name, where)
        if differing := _difference(_values(signal), _values(fields[other])):
            raise DbcError(
                f"{other} and {where} have different VAL_ rows ({differing}); "
                "make them equal, or rename a field"
            )


def _check_named_once(named: dict[str, Enumeration]) -> None:
    seen: dict[str, str] = {}
    for where, one in named.items():
        for name in filter(None, (one.python, one.c)):
            other = seen.setdefault(name, where)
            if other != where:
                raise DbcError(
                    f"{other} and {where} both name the enumeration {name}; name it at one of them: "
                    "a field with equal VAL_ rows has it, too"
                )


def _matching(where: str, signal: Signal, named: dict[str, Enumeration]) -> Enumeration | None:
    """Return the enumeration with the same rows as a field that names none."""
    if attribute(signal, "NoEnum"):
        if not signal.choices:
            raise DbcError(f"{where} has NoEnum, and no VAL_ rows; remove it")
        return None
    values = _values(signal)
    same = [one for one in named.values() if values and one.values == values]
    if len(same) > 1 or (values and not same):
        raise DbcError(
            f"{where}: its VAL_ rows are those of {len(same) or 'no'} enumeration{'s' * (len(same) > 1)}; "
            "name its own with PythonEnum or CEnum, or write NoEnum 1 if it is to have none"
        )
    return same[0] if same else None


def _difference(one: dict[str, int], other: dict[str, int]) -> str:
    differing = sorted((value, name) for name, value in one.items() ^ other.items())
    return ", ".join(f"{value} {name}" for value, name in differing)
