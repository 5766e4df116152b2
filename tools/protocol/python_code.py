"""Python of the messages: `dcmp_hil/wire/messages.py` and `dcmp_hil/wire/layouts.py`."""

from __future__ import annotations

import builtins
import subprocess
import sys
from typing import TYPE_CHECKING

from tools.protocol.dbc import ROOT
from tools.protocol.layout import MARK, Field, Layout, Word, enumerations_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tools.protocol.enumerations import Enumeration

_LINE_LENGTH_MAX = 110
_FILE = "dcmp_hil/wire/messages.py"  # whose rules the formatter takes
_CODES = {1: "B", 2: "H", 4: "I"}
_MESSAGES = f'''# {MARK}
"""Messages of the DBC, field by field."""

from enum import IntEnum
from typing import NamedTuple
'''
_LAYOUTS = f'''# {MARK}
"""Payloads of the messages, without their crc8, by `struct`."""

from __future__ import annotations

from struct import Struct, error
from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.wire.messages import ({{names}})

if TYPE_CHECKING:
    from collections.abc import Callable


class MessageLayout(NamedTuple):
    """A message's class, its payload's length in bytes, and both ways; `pack` raises `struct.error`.

    `pack` returns the payload without its crc8, `unpack` takes it with the crc8.
    """

    kind: Any
    length: int
    pack: Callable[[Any], bytes]
    unpack: Callable[[bytes], Any]


def _check(value: int, most: int) -> None:
    """Raise what `struct` raises if a field does not fit that shares its bytes with others."""
    if not 0 <= value <= most:
        raise error


# `_take_*` reads the crc8's byte, too: the exact length is a little faster than `unpack_from`.
'''


def protocol_hash(value: int) -> str:
    """Return the text of protocol_hash.py."""
    docstring = '"""Hash that host and device compare before anything else."""'
    return f"# {MARK}\n{docstring}\n\nPROTOCOL_HASH = 0x{value:08X}\n"


def messages(found: list[Layout]) -> str:
    """Return the text of messages.py."""
    parts = [_MESSAGES]
    parts += [_enum(one) for one in enumerations_of(found) if one.python and "." not in one.python]
    parts += [_class(layout) for layout in found]
    parts.append(f"Message = ({' | '.join(layout.python for layout in found)})\n")
    return _formatted("\n\n".join(parts))


def layouts(found: list[Layout]) -> str:
    """Return the text of layouts.py."""
    parts = [_LAYOUTS.format(names=", ".join(sorted(layout.python for layout in found)))]
    parts += ["\n".join(_functions(layout)) for layout in found]
    rows = [
        f"{one.identifier >> 4}: MessageLayout({one.python}, {one.length}, _pack_{one.name.lower()}, "
        f"_unpack_{one.name.lower()}),"
        for one in found
    ]
    parts.append("\n".join(["LAYOUTS = {", *rows, "}", '"""By message number."""', ""]))
    return _formatted("\n\n".join(parts))


def _formatted(text: str) -> str:
    """Return text in the project's own format, in every current folder."""
    named = ["--config", str(ROOT / "pyproject.toml"), "--stdin-filename", str(ROOT / _FILE)]
    command = [sys.executable, "-m", "ruff", "format", *named, "-"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=True, cwd=ROOT)  # noqa: S603
    return done.stdout


# ------------------------------------------------------------------------------------- messages.py


def _enum(one: Enumeration) -> str:
    rows = [f"    {name} = {value}" for name, value in one.values.items()]
    return "\n".join([f"class {one.python}(IntEnum):", f'    """{one.comment}"""', "", *rows, ""])


def _class(layout: Layout) -> str:
    head = [f"class {layout.python}(NamedTuple):", f'    """{layout.name}: {layout.summary}"""', ""]
    return "\n".join([*head, *(line for field in layout.fields for line in _member(field)), ""])


def _member(field: Field) -> Iterator[str]:
    member = f"    {field.name}: {'bool' if field.flag else 'int'}"
    remark = f"  # {_remark(field)}".rstrip(" #")
    if len(member + remark) <= _LINE_LENGTH_MAX:
        yield member + remark
    else:
        yield f"  {remark}"
        yield member


def _remark(field: Field) -> str:
    """Return bounds with their unit, or the name of the values, and the comment if it is not said there."""
    if field.flag:
        return field.comment
    if field.enumeration and field.enumeration.python:
        return f"a {field.enumeration.python}"
    return ". ".join(filter(None, [f"{field.least}..{field.most} {field.unit}".strip(), field.comment]))


# -------------------------------------------------------------------------------------- layouts.py


def _functions(layout: Layout) -> Iterator[str]:
    """Write both functions of a message; where all its fields are whole words, they are one call."""
    name, constant, codes = layout.name.lower(), f"_{layout.name}", _codes(layout)
    plain = all(len(_code(word)) == 1 and not word.shared for word in layout.words) and _in_order(layout)
    yield f'{constant} = Struct("<{codes}")'
    yield f'_take_{name} = Struct("<{codes}x").unpack'
    yield from _tables(layout)
    yield f"\n\ndef _pack_{name}(message: {layout.python}) -> bytes:"
    yield from _plain_pack(constant) if plain else _pack(layout)
    yield f"\n\ndef _unpack_{name}(data: bytes) -> {layout.python}:"
    yield from _plain_unpack(layout) if plain else _unpack(layout)
    yield ""


def _in_order(layout: Layout) -> bool:
    return layout.fields == tuple(field for word in layout.words for field in word.fields)


def _plain_pack(constant: str) -> Iterator[str]:
    yield f"    return {constant}.pack(*message)"


def _plain_unpack(layout: Layout) -> Iterator[str]:
    yield f"    return make({layout.python}, _take_{layout.name.lower()}(data))"


def _codes(layout: Layout) -> str:
    """Return the codes of `struct`; a byte without a field is x."""
    codes, byte = "", 0
    for word in layout.words:
        codes += "x" * (word.byte - byte) + _code(word)
        byte = word.byte + word.bytes
    return codes + "x" * (layout.length - 1 - byte)


def _code(word: Word) -> str:
    if word.split:
        return "HB"
    code = _CODES[word.bytes]
    return code.lower() if word.fields[0].signed else code


def _tables(layout: Layout) -> Iterator[str]:
    """Write a table of each shared byte whose fields follow each other."""
    for word in filter(lambda word: _has_table(layout, word), layout.words):
        parts = _tuple(_part(word, field, "byte") for field in word.fields)
        yield f"_{layout.name}_BYTE_{word.byte} = [{parts} for byte in range(256)]"
        yield f'"""{", ".join(field.name for field in word.fields)}, for each value of their byte."""'


def _has_table(layout: Layout, word: Word) -> bool:
    first = layout.fields.index(word.fields[0])
    return word.shared and word.bytes == 1 and layout.fields[first : first + len(word.fields)] == word.fields


def _pack(layout: Layout) -> Iterator[str]:
    yield f"    {_tuple(map(_local, layout.fields))} = message"
    for word in filter(lambda word: word.shared, layout.words):
        yield from _join(word)
    parts = ", ".join(part for word in layout.words for part in _packed(word))
    yield f"    return _{layout.name}.pack({parts})"


def _join(word: Word) -> Iterator[str]:
    """Write a shared word; `struct` itself refuses what is too large for the highest field."""
    numbers = [field for field in word.fields if not field.flag]
    for field in numbers:
        if word.shift(field) + field.bits < 8 * word.bytes:
            yield f"    _check({_local(field)}, {(1 << field.bits) - 1})"
    yield f"    {_name(word)} = {' | '.join(_shifted(word, field) for field in numbers) or '0'}"
    for field in word.fields:
        if field.flag:
            yield f"    if {_local(field)}:"
            yield f"        {_name(word)} |= {1 << word.shift(field)}"


def _shifted(word: Word, field: Field) -> str:
    shift = word.shift(field)
    return f"{_local(field)} << {shift}" if shift else _local(field)


def _packed(word: Word) -> list[str]:
    if word.shared:
        return [_name(word)]
    name = _local(word.fields[0])
    return [f"{name} & 0xFFFF", f"{name} >> 16"] if word.split else [name]


def _unpack(layout: Layout) -> Iterator[str]:
    names = ", ".join(name for word in layout.words for name in _unpacked(word))
    yield f"    {names} = _take_{layout.name.lower()}(data)"
    yield f"    return make({layout.python}, {_fields(layout)})"


def _unpacked(word: Word) -> list[str]:
    if word.shared:
        return [_name(word)]
    name = _local(word.fields[0])
    return [f"{name}_low", f"{name}_high"] if word.split else [name]


def _fields(layout: Layout) -> str:
    """Return the tuple of all fields, in the structure's order: single ones, and rows of the tables."""
    groups: list[list[str] | str] = []
    for field in layout.fields:
        word = layout.word(field)
        if _has_table(layout, word):
            if field == word.fields[0]:
                groups.append(f"_{layout.name}_BYTE_{word.byte}[{_name(word)}]")
            continue
        if not groups or isinstance(groups[-1], str):
            groups.append([])
        last = groups[-1]
        assert isinstance(last, list)  # noqa: S101 - for the type checker
        last.append(_value(word, field))
    return " + ".join(one if isinstance(one, str) else _tuple(one) for one in groups)


def _value(word: Word, field: Field) -> str:
    if word.shared:
        return _part(word, field, _name(word))
    name = _local(field)
    return f"{name}_low | {name}_high << 16" if word.split else name


def _part(word: Word, field: Field, of: str) -> str:
    """Return a field's part of a shared word."""
    shift = word.shift(field)
    if field.flag:
        return f"{of} & {1 << shift} != 0"
    shifted = f"{of} >> {shift}" if shift else of
    return shifted if shift + field.bits == 8 * word.bytes else f"{shifted} & {(1 << field.bits) - 1}"


def _tuple(parts: Iterable[str]) -> str:
    """Return a tuple; the comma behind a single part, and only that one, has a meaning."""
    every = list(parts)
    return f"({', '.join(every)}{',' * (len(every) == 1)})"


def _name(word: Word) -> str:
    return f"shared_{word.byte}"


def _local(field: Field) -> str:
    """Return a field's name as a variable: none of Python's own."""
    return f"{field.name}_" if hasattr(builtins, field.name) else field.name
