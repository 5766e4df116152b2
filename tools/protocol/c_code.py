"""C of the messages: structures and values of `firmware/core/dcmp_protocol.h`, pack and unpack."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tools.protocol.layout import MARK, Field, Layout, Word, enumerations_of
from tools.protocol.rules import check_once

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tools.protocol.enumerations import Enumeration

_LINE_LENGTH_MAX = 120
_RENAMED = {"FAULT": "FAULTED", "NONE": "NO_FAULT"}
"""Values whose own name is that of a message, or says too little without its enumeration."""
_MACROS = ("DCMP_PROTOCOL_H", "DCMP_PROTOCOL_HASH", "DCMP_LAYOUTS", "DCMP_FROM_HOST")
_INCLUDES = '#include <stdbool.h>\n#include <stdint.h>\n\n#include "dcmp_frame.h"\n'
_BIT_PACK = """
static uint32_t bit(bool value, unsigned int position)
{
    return value ? 1u << position : 0u;
}
"""
_PUT = """
static void put(uint8_t *data, uint32_t value, unsigned int bytes)
{
    for (unsigned int i = 0; i < bytes; i++) {
        data[i] = (uint8_t)((value >> (8u * i)) & 0xFFu);
    }
}
"""
_GET = """
static uint32_t get(const uint8_t *data, unsigned int bytes)
{
    uint32_t value = 0;
    for (unsigned int i = 0; i < bytes; i++) {
        value |= (uint32_t)data[i] << (8u * i);
    }
    return value;
}
"""
_BIT_UNPACK = """
static bool bit(uint32_t value, unsigned int position)
{
    return ((value >> position) & 1u) != 0u;
}
"""
_BITS_UNPACK = """
static uint32_t bits(uint32_t value, uint32_t mask, unsigned int position)
{
    return (value >> position) & mask;
}
"""


def protocol_hash(value: int) -> str:
    """Return the text of dcmp_protocol_hash.h."""
    return _header("DCMP_PROTOCOL_HASH_H", f"#define DCMP_PROTOCOL_HASH 0x{value:08x}u\n")


def header(found: list[Layout]) -> str:
    """Return the text of dcmp_protocol.h.

    Raises
    ------
    DbcError
        If two constants have one name.
    """
    named = [one for one in enumerations_of(found) if one.c]
    names = [name for one in named for name in map(_constant, one.values)]
    check_once("constants of C", [*_MACROS, *names, *(f"DCMP_{one.name}" for one in found)])
    tables = [_layouts(found), _from_host(found)]
    parts = [_INCLUDES, _identifiers(found), *map(_enum, named), *tables, *map(_struct, found)]
    parts.append("/* Packing seals; unpacking takes a frame that was found genuine. */")
    parts[-1] += "".join(f"\n{_pack_head(one)};" for one in found) + "\n"
    parts.append("\n".join(f"{_unpack_head(one)};" for one in found) + "\n")
    return _header("DCMP_PROTOCOL_H", "\n".join(parts))


def pack(found: list[Layout]) -> str:
    """Return the text of dcmp_pack.c."""
    functions = ["\n".join([_pack_head(one), "{", *_pack(one), "}", ""]) for one in found]
    helpers = {"bit(": _BIT_PACK, "put(": _PUT}
    return _source("Structures into frames", '#include "dcmp_message.h"', helpers, functions)


def unpack(found: list[Layout]) -> str:
    """Return the text of dcmp_unpack.c."""
    functions = ["\n".join([_unpack_head(one), "{", *_unpack(one), "}", ""]) for one in found]
    helpers = {"get(": _GET, "bit(": _BIT_UNPACK, "bits(": _BITS_UNPACK}
    return _source("Frames into structures", '#include "dcmp_protocol.h"', helpers, functions)


def _header(guard: str, text: str) -> str:
    return f"/* {MARK} */\n#ifndef {guard}\n#define {guard}\n\n{text}\n#endif\n"


def _source(summary: str, include: str, helpers: dict[str, str], functions: list[str]) -> str:
    """Return a C file with those helpers that its functions call."""
    text = "\n".join(functions)
    used = "".join(helper for call, helper in helpers.items() if f" {call}" in text or f"){call}" in text)
    head = f"/* {MARK} */\n/* {summary}: little-endian, bit positions as in the DBC. */\n"
    return f"{head}{include}\n{used}\n{text}"


# --------------------------------------------------------------------------------- dcmp_protocol.h


def _identifiers(found: list[Layout]) -> str:
    rows = ",\n".join(f"    DCMP_{one.name} = 0x{one.identifier:03X}" for one in found)
    return f"/* Identifiers of node 0. */\nenum dcmp_message {{\n{rows}\n}};\n"


def _enum(one: Enumeration) -> str:
    rows = ",\n".join(f"    {_constant(name)} = {value}" for name, value in one.values.items())
    return f"/* {one.comment} */\nenum {one.c} {{\n{rows}\n}};\n"


def _constant(name: str) -> str:
    return f"DCMP_{_RENAMED.get(name, name)}"


def _layouts(found: list[Layout]) -> str:
    """Return the table of what a receiver must know of a frame, by message number, from 0 on."""
    by_number = {one.identifier >> 4: one for one in found}
    rows = []
    for number in range(max(by_number) + 1):
        one = by_number.get(number)
        row = f"{{{one.length}, {str(one.from_host).lower()}}}" if one else "{0, false}"
        rows.append(f"    {row + ',':12} /* {one.name if one else 'no message'} */ \\\n")
    head = "/* By message number, which is identifier / 16: length, and whether the host sends it. */"
    return f"{head}\n#define DCMP_LAYOUTS {{ \\\n{''.join(rows)}}}\n"


def _from_host(found: list[Layout]) -> str:
    """Return the list of the messages that a device must receive, for an acceptance filter of CAN."""
    rows = ", \\\n".join(f"    DCMP_{one.name}" for one in found if one.from_host)
    head = "/* Identifiers, of node 0, of the messages that the host sends. */"
    return f"{head}\n#define DCMP_FROM_HOST {{ \\\n{rows} \\\n}}\n"


def _struct(layout: Layout) -> str:
    members = "".join(f"    {line}\n" for field in layout.fields for line in _member(field))
    return f"/* {layout.name}: {layout.summary} */\nstruct {layout.c} {{\n{members}}};\n"


def _member(field: Field) -> Iterator[str]:
    member, remark = f"{_type(field)} {field.name};", _remark(field)
    if not remark:
        yield member
    elif len(f"    {member} /* {remark} */") <= _LINE_LENGTH_MAX:
        yield f"{member} /* {remark} */"
    else:
        yield f"/* {remark} */"
        yield member


def _remark(field: Field) -> str:
    """Return the enumeration, or the bounds where the type has others, and the comment."""
    if field.enumeration and field.enumeration.c:
        return f"enum {field.enumeration.c}"
    size = _size(field)
    of_type = (-(1 << size - 1), (1 << size - 1) - 1) if field.signed else (0, (1 << size) - 1)
    bounds = "" if field.flag or (field.least, field.most) == of_type else f"{field.least}..{field.most}"
    return ". ".join(filter(None, [bounds, field.comment]))


def _size(field: Field) -> int:
    return next(size for size in (8, 16, 32) if field.bits <= size)


def _type(field: Field) -> str:
    return "bool" if field.flag else f"{'' if field.signed else 'u'}int{_size(field)}_t"


# ---------------------------------------------------------------------------------- pack and unpack


def _pack_head(one: Layout) -> str:
    parameters = f"struct dcmp_frame *frame, uint8_t node, const struct {one.c} *message"
    return f"void dcmp_pack_{one.name.lower()}({parameters})"


def _unpack_head(one: Layout) -> str:
    return f"void dcmp_unpack_{one.name.lower()}(const struct dcmp_frame *frame, struct {one.c} *message)"


def _pack(layout: Layout) -> Iterator[str]:
    for word in layout.words:
        if _mixed(word):
            yield from _wrapped(f"    const uint32_t {_flags(word)} =", _bits(word), ";")
    byte = 0
    for word in layout.words:
        if word.byte > byte:
            yield f"    put(&frame->data[{byte}], 0, {word.byte - byte});"
        yield from _wrapped(f"    put(&frame->data[{word.byte}],", _packed(word), f", {word.bytes});")
        byte = word.byte + word.bytes
    if byte < layout.length - 1:
        yield f"    put(&frame->data[{byte}], 0, {layout.length - 1 - byte});"
    yield f"    dcmp_seal(frame, DCMP_{layout.name}, node);"


def _mixed(word: Word) -> bool:
    """Whether a word has flags and numbers."""
    return 0 < sum(field.flag for field in word.fields) < len(word.fields)


def _packed(word: Word) -> list[str]:
    """Return the parts of a word, to be joined by or."""
    if not word.shared:
        field = word.fields[0]
        return [f"{f'(uint{field.bits}_t)' if field.signed else ''}message->{field.name}"]
    numbers = [_number(word, field) for field in word.fields if not field.flag]
    return [*numbers, *([_flags(word)] if _mixed(word) else _bits(word))]


def _bits(word: Word) -> list[str]:
    return [f"bit(message->{field.name}, {word.shift(field)})" for field in word.fields if field.flag]


def _number(word: Word, field: Field) -> str:
    shift, masked = word.shift(field), f"((uint32_t)message->{field.name} & {_mask(field)})"
    return f"({masked} << {shift})" if shift else masked


def _wrapped(line: str, parts: list[str], end: str) -> Iterator[str]:
    """Yield parts joined by or, on as many lines as they need."""
    for at, part in enumerate(parts):
        text = f" {part}" + (end if at + 1 == len(parts) else " |")
        if len(line + text) > _LINE_LENGTH_MAX:
            yield line
            line = "       "
        line += text
    yield line


def _unpack(layout: Layout) -> Iterator[str]:
    for word in layout.words:
        if word.shared and not _is_byte_of_flags(word):
            yield f"    const uint32_t {_shared(word)} = {_read(word)};"
    for field in layout.fields:
        yield f"    message->{field.name} = {_unpacked(layout.word(field), field)};"


def _unpacked(word: Word, field: Field) -> str:
    """Return a field's value, in its own type."""
    if field.flag:
        return f"bit({_read(word) if _is_byte_of_flags(word) else _shared(word)}, {word.shift(field)})"
    value = f"bits({_shared(word)}, {_mask(field)}, {word.shift(field)})" if word.shared else _read(word)
    read_as = "uint8_t" if not word.shared and word.bytes == 1 else "uint32_t"
    return value if _type(field) == read_as else f"({_type(field)}){value}"


def _is_byte_of_flags(word: Word) -> bool:
    return word.bytes == 1 and all(field.flag for field in word.fields)


def _read(word: Word) -> str:
    return f"frame->data[{word.byte}]" if word.bytes == 1 else f"get(&frame->data[{word.byte}], {word.bytes})"


def _mask(field: Field) -> str:
    mask = (1 << field.bits) - 1
    return f"0x{mask:X}u" if mask > 9 else f"{mask}u"  # noqa: PLR2004 - one digit


def _flags(word: Word) -> str:
    return f"flags_{word.byte}"


def _shared(word: Word) -> str:
    return f"shared_{word.byte}"
