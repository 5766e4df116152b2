"""Statements of the DBC's text: each on a line of its own, of a known kind, once, about what is there.

What cantools reads without a word, and the protocol hash does not cover, is refused here: the hash covers
whole lines that begin with `BO_ `, `SG_ ` or `VAL_ `.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

_TEXT = r'"[^"\\]*"'
_OF = r"(?:BO_ (?P<message>\d+)|SG_ (?P<of>\d+) (?P<signal>\w+))"
_SIGNAL_EXAMPLE = 'SG_ tick : 8|8@1+ (1,0) [0|255] "tick" HOST'
_FORMS = {
    "VERSION": (rf"VERSION {_TEXT}", 'VERSION "1"'),
    "NS_": (r"NS_ ?:", "NS_ :"),
    "BS_": (r"BS_ ?:", "BS_:"),
    "BU_": (r"BU_ ?: HOST DEVICE", "BU_: HOST DEVICE"),
    "BO_": (r"BO_ (?P<message>\d+) (?P<name>\w+) ?: \d+ \w+", "BO_ 48 FAULT: 7 DEVICE"),
    "SG_": (
        rf"SG_ (?P<signal>\w+)(?P<multiplexed> \w+)? ?: \d+\|\d+@[01][+-] \(\S+\) \[\S+\] {_TEXT} \w+",
        _SIGNAL_EXAMPLE,
    ),
    "CM_": (rf"CM_ (?:{_OF} )?{_TEXT} ?;", 'CM_ SG_ 48 code "The fault that is latched.";'),
    "BA_DEF_": (
        r'BA_DEF_ (?P<kind>BO_|SG_) "(?P<name>\w+)" (?:STRING|INT 0 1) ?;',
        'BA_DEF_ SG_ "CEnum" STRING ;',
    ),
    "BA_DEF_DEF_": (r'BA_DEF_DEF_ "(?P<name>\w+)" (?:""|0) ?;', 'BA_DEF_DEF_ "CEnum" "";'),
    "BA_": (rf'BA_ "(?P<name>\w+)" {_OF} (?:{_TEXT}|\d+) ?;', 'BA_ "CEnum" SG_ 48 code "dcmp_fault_code";'),
    "VAL_": (rf"VAL_ (?P<of>\d+) (?P<signal>\w+)(?: \d+ {_TEXT})+ ?;", 'VAL_ 16 reason 0 "REQUESTED";'),
}
"""Forms of the statements, by keyword, with an example."""
_REMEDIES = {
    "VAL_TABLE_": "no field can refer to it in this format: write its rows as VAL_ at each field",
    "SIG_VALTYPE_": "the wire has integers: write the quantity as an integer, with its unit in its name",
    "SG_MUL_VAL_": "a message has one layout: give each layout a message of its own",
    "BO_TX_BU_": "a message has one sender, HOST or DEVICE: give each sender a message of its own",
}
"""Remedies for statements that cantools reads, and that the generators would leave away."""
_ATTRIBUTES = {
    "PythonClass": "BO_",
    "CStruct": "BO_",
    "PythonEnum": "SG_",
    "CEnum": "SG_",
    "PlacedBefore": "SG_",
    "NoEnum": "SG_",
}
"""Attributes that the generators know, and what has them: messages or fields."""
_EXTENDED = 1 << 31
_STEP, _NUMBER_MAX = 16, 127


class DbcError(ValueError):
    """The DBC says something that the generators would get wrong: where, what, and what to write instead."""


@dataclass(frozen=True)
class _Statement:
    """A statement: its line, its keyword, what it names, and the message or the field that it is about."""

    line: int
    keyword: str
    name: str
    message: int | None
    signal: str
    text: str
    kind: str = ""


def check(text: str) -> None:
    """Compare a DBC's text with the forms.

    Raises
    ------
    DbcError
        At the first statement that is not of them.
    """
    found = [_statement(at, line.strip()) for at, line in enumerate(text.splitlines(), 1) if line.strip()]
    placed = _placed(found)
    _check_numbers(placed)
    _check_subjects(placed)
    for one in placed:
        if one.keyword == "VAL_":
            _check_values(one)


def _statement(at: int, line: str) -> _Statement:
    keyword = line.split(maxsplit=1)[0].partition(":")[0]
    where = f"line {at}"
    if keyword in _REMEDIES:
        raise DbcError(f"{where}: {keyword} is not understood; {_REMEDIES[keyword]}")
    if keyword not in _FORMS:
        raise DbcError(f"{where}: {line!r} is not understood; a statement has one line, which it begins")
    form, example = _FORMS[keyword]
    fits = re.fullmatch(form, line)
    if fits is None:
        raise DbcError(f"{where}: {line!r} is not understood; write it in one line, as in {example}")
    named = fits.groupdict()
    if named.get("multiplexed"):
        raise DbcError(f"{where}: {named['signal']} is multiplexed; {_REMEDIES['SG_MUL_VAL_']}")
    _check_signs(where, line, keyword)
    number = named.get("message") or named.get("of")
    return _Statement(
        line=at,
        text=line,
        keyword=keyword,
        name=named.get("name") or "",
        message=int(number) if number else None,
        signal=named.get("signal") or "",
        kind=named.get("kind") or ("SG_" if named.get("signal") else "BO_") * (number is not None),
    )


def _check_signs(where: str, line: str, keyword: str) -> None:
    """Refuse letters that C's names have not, and signs that would end what a text is written into."""
    for word in re.sub(_TEXT, "", line).split():
        if not word.isascii():
            raise DbcError(f"{where}: {word} has other letters than a to z and A to Z; rename it")
    if "*/" in line or "/*" in line:
        raise DbcError(f"{where}: {line!r} would begin or end a comment of C; leave the * or the / away")
    if keyword == "CM_" and "|" in line:
        raise DbcError(f"{where}: {line!r} would end a cell of the page's table; leave the | away")


def _placed(found: list[_Statement]) -> list[_Statement]:
    """Return the statements; fields with the number of their message."""
    placed, message = [], None
    for one in found:
        if one.keyword == "BO_":
            message = one.message
        elif one.keyword == "SG_":
            placed.append(replace(one, message=message))
            continue
        placed.append(one)
    return placed


def _check_numbers(found: list[_Statement]) -> None:
    """Refuse identifiers that break the rule of docs/protocol.md, section 1, or stand twice."""
    messages = [one for one in found if one.keyword == "BO_"]
    taken = {one.message for one in messages}
    free = next(n for n in range(_STEP, _STEP * (_NUMBER_MAX + 2), _STEP) if n not in taken)
    by_number: dict[int | None, str] = {}
    for one in messages:
        number = one.message or 0
        remedy = f"it is 16 times the message's number, which is 1 to {_NUMBER_MAX}; {free} is free"
        if number & _EXTENDED:
            raise DbcError(
                f"{one.name}: its identifier {number} is extended, and has 11 bits on the wire; {remedy}"
            )
        if number % _STEP or not _STEP <= number <= _STEP * _NUMBER_MAX:
            raise DbcError(f"{one.name}: its identifier {number} is not of node 0; {remedy}")
        if number in by_number:
            raise DbcError(f"{by_number[number]} and {one.name}: both have the identifier {number}; {remedy}")
        by_number[number] = one.name


def _check_subjects(found: list[_Statement]) -> None:
    """Refuse a statement about what is not there, or one that stands twice."""
    fields = {(one.message, one.signal) for one in found if one.keyword in {"BO_", "SG_"}}
    seen: dict[tuple[object, ...], int] = {}
    for one in found:
        where = f"line {one.line}: {one.text!r}"
        if one.message is not None and (one.message, one.signal) not in fields:
            raise DbcError(
                f"{where} is about what is not there; correct its number or its name, or remove it"
            )
        if one.keyword.startswith("BA_") and one.kind not in ("", _ATTRIBUTES.get(one.name)):
            known = ", ".join(f"{name} ({kind})" for name, kind in _ATTRIBUTES.items())
            raise DbcError(f"{where} is an attribute that is not understood; these are: {known}")
        about = (one.keyword, one.name, one.message if one.keyword != "BO_" else None, one.signal)
        if about in seen:
            raise DbcError(f"{where} says again what line {seen[about]} says; rename or remove one")
        seen[about] = one.line


def _check_values(one: _Statement) -> None:
    """Refuse numbers and names that stand twice: cantools takes the last."""
    rows = re.findall(rf"(\d+) ({_TEXT})", one.text.split(maxsplit=3)[3])
    for every in zip(*rows, strict=True):
        twice = sorted({each for each in every if every.count(each) > 1})
        if twice:
            raise DbcError(
                f"line {one.line}: VAL_ of {one.signal} has {twice[0]} twice; remove or renumber one"
            )
