"""soc/stm32f4/regs.h against the vendor's description: addresses, offsets, bit positions, masks."""

from __future__ import annotations

import re
import subprocess
from typing import TYPE_CHECKING, Any, NamedTuple

from cffi import FFI

from tests.firmware.core_library import HERE, compiler
from tests.target.build import FIRMWARE
from tests.target.machine.svd import peripherals

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET
    from collections.abc import Iterator

REGS = FIRMWARE / "soc/stm32f4/regs.h"

_NAMES = {"SYSTICK": "STK"}
"""What we call otherwise than the vendor."""
_CORES_OWN = (
    "STM32L4x2"  # the same vendor's description of another Cortex-M4: that of the F429 leaves them out
)
_OWN = ("SCB", "STK")
_RENAMED = {
    "CFSR": "CFSR_UFSR_BFSR_MMFSR",  # three registers of fewer bits in one word
    "TIR": "TI0R",  # of any mailbox
}
NO_FIELD = {
    "FLASH_KEY1": "a key, RM0090 3.6.1; KEYR is one field of 32 bits",
    "FLASH_KEY2": "a key, RM0090 3.6.1; KEYR is one field of 32 bits",
    "IWDG_KEY_START": "a key, RM0090 21.4.1; KR is one field of 16 bits",
    "IWDG_KEY_FEED": "a key, RM0090 21.4.1; KR is one field of 16 bits",
    "IWDG_KEY_WRITE": "a key, RM0090 21.4.1; KR is one field of 16 bits",
    "SCB_AIRCR_KEY": "a key, PM0214 4.4.5: the field is called otherwise when it is written",
    "TIM_CCMR_S_OWN": "the value of any channel's CCxS: RM0090 18.4.7, 01",
    "TIM_CCMR_S_TRC": "the value of any channel's CCxS: RM0090 18.4.7, 11",
}
"""Definitions without a field of their own in the description, and what they are."""


class Field(NamedTuple):
    """A bit field of a register."""

    position: int
    width: int


class Header(NamedTuple):
    """Registers and constants of regs.h."""

    structs: dict[str, dict[str, int]]  # every word's offset, by its path: "T[1].IR"
    peripherals: dict[str, tuple[str, int]]  # structure and address
    constants: dict[str, int]


def _preprocess(text: str, *options: str) -> str:
    command = [compiler(), "-E", "-P", "-nostdinc", f"-I{HERE / 'no_headers'}", *options, "-"]
    return subprocess.run(command, check=True, input=text, capture_output=True, text=True).stdout


def _words(kind: Any, path: str = "", offset: int = 0) -> Iterator[tuple[str, int]]:
    """Yield every integer inside a type, arrays and structures taken apart."""
    if kind.kind == "struct":
        for name, field in kind.fields:
            yield from _words(field.type, f"{path}.{name}" if path else name, offset + field.offset)
    elif kind.kind == "array":
        ffi = FFI()
        for i in range(kind.length):
            yield from _words(kind.item, f"{path}[{i}]", offset + i * ffi.sizeof(kind.item))
    else:
        yield path, offset


def read_header(text: str) -> Header:
    """Take a header apart; every macro is a peripheral or a constant."""
    macros = set(re.findall(r"^#define (\w+) ", _preprocess(text, "-dM"), re.MULTILINE))
    macros -= set(re.findall(r"^#define (\w+) ", _preprocess("#include <stdint.h>", "-dM"), re.MULTILINE))
    asked = "\n".join(f'"{name}" {name}' for name in sorted(macros))
    expanded = _preprocess(f"{text}\n{asked}")
    values = dict(re.findall(r'^"(\w+)" (.+)$', expanded, re.MULTILINE))
    pointers = {k: re.fullmatch(r"\(\(struct (\w+) \*\)(\w+)u\)", v) for k, v in values.items()}
    ffi = FFI()
    ffi.cdef("\n".join(line for line in expanded.splitlines() if not line.startswith('"')))
    plain = [name for name in values if not pointers[name]]
    ffi.cdef("enum constants {" + ",".join(f"REGS_{name} = {values[name]}" for name in plain) + "};")
    constants = ffi.typeof("enum constants").relements
    return Header(
        {name: dict(_words(ffi.typeof(f"struct {name}"))) for name in re.findall(r"struct (\w+) \{", text)},
        {k: (found[1], int(found[2], 0)) for k, found in pointers.items() if found},
        {name: constants[f"REGS_{name}"] for name in plain},
    )


def _element(name: str) -> tuple[ET.Element, ET.Element] | None:
    """Return a peripheral's own entry, and the one with its registers."""
    name = _NAMES.get(name, name)
    chip = peripherals(_CORES_OWN) if name in _OWN else peripherals()
    if name not in chip:
        return None
    return chip[name], chip.get(chip[name].get("derivedFrom", ""), chip[name])


def _registers(name: str) -> Iterator[tuple[str, int, ET.Element]]:
    """Yield name, address and entry of every register of a peripheral."""
    found = _element(name)
    if found is None:
        return
    base = int(found[0].findtext("baseAddress", "0"), 16)
    for register in found[1].iter("register"):
        label = re.sub(r"_(Output|Input)$", "", register.findtext("name", ""))  # the timers' twofold ones
        yield label, base + int(register.findtext("addressOffset", "0"), 0), register


def _vendors_name(path: str) -> str | None:
    """Return what the vendor calls a word of a structure; None inside another one's word, and for a gap."""
    if path.startswith("reserved_"):
        return None
    if found := re.fullmatch(r"IPR\[(\d+)\]", path):  # bytes here, words there
        return None if int(found[1]) % 4 else f"IPR{int(found[1]) // 4}"
    if found := re.fullmatch(r"([TR])\[(\d+)\]\.(\w+)R", path):
        return f"{found[1]}{found[3]}{found[2]}R"
    path = re.sub(r"F\[(\d+)\]\.", r"F\1", path)
    path = re.sub(r"\[(\d+)\]", r"\1", path)
    return _RENAMED.get(path, path)


def _misplaced(name: str, base: int, words: dict[str, int], there: dict[int, set[str]]) -> Iterator[str]:
    """Yield the words of one peripheral that the vendor has elsewhere, or under another name."""
    known = {label: address for address, labels in there.items() for label in labels}
    for path, offset in words.items():
        ours = _vendors_name(path)
        found = there.get(base + offset, set())
        if found and ours not in found and not path.startswith("IPR["):
            yield f"{name}: {path} is {' or '.join(found)}"
        if ours in known and known[ours] != base + offset:
            yield f"{name}: {path} is at {base + offset:#x}, not at {known[ours]:#x}"


def check_offsets(header: Header) -> Iterator[str]:
    """Yield every disagreement about where a register is."""
    proven: dict[str, set[str]] = {}
    for name, (struct, base) in header.peripherals.items():
        there: dict[int, set[str]] = {}
        for label, address, _ in _registers(name):
            there.setdefault(address, set()).add(label)
        if not there:
            yield f"{name}: no such peripheral"
        words = header.structs[struct]
        yield from _misplaced(name, base, words, there)
        right = {
            path for path, offset in words.items() if _vendors_name(path) in there.get(base + offset, ())
        }
        proven.setdefault(struct, set()).update(re.sub(r"\[\d+\]", "[]", path) for path in right)
    yield from _unproven(header, proven)


def _unproven(header: Header, proven: dict[str, set[str]]) -> Iterator[str]:
    used = {struct for struct, _ in header.peripherals.values()}
    inner = {"can_mailbox", "can_filter"}  # proven as parts of `can`
    for struct, words in header.structs.items():
        if struct not in used | inner:
            yield f"struct {struct}: no peripheral has it"
        for path in words if struct in used else ():
            pattern = re.sub(r"\[\d+\]", "[]", path)
            if not pattern.startswith("reserved_") and pattern not in proven.get(struct, set()):
                yield f"struct {struct}: no peripheral has a register {path} there"


def _fields(prefix: str, register: str, header: Header) -> Iterator[tuple[str, dict[str, Field]]]:
    """Yield the fields of a register, in every peripheral that has it."""
    wanted = _RENAMED.get(register, register)
    for name in header.peripherals:
        fields = {
            field.findtext("name", ""): Field(
                int(field.findtext("bitOffset", ""), 0), int(field.findtext("bitWidth", ""), 0)
            )
            for label, _, entry in _registers(name)
            if label == wanted and re.fullmatch(rf"{prefix}\d*", name)
            for field in entry.iter("field")
        }
        if fields:
            yield name, fields


def _mask(fields: dict[str, Field]) -> int:
    return sum(((1 << field.width) - 1) << field.position for field in fields.values())


def _agrees(word: str, value: int, fields: dict[str, Field]) -> bool | None:
    """Whether a constant is what a register's fields say; None if there is no such field."""
    if word == "ALL":
        return value == _mask(fields)
    label = word.removesuffix("_POS")
    if label != word:
        # wide fields are described bit by bit in places: PLLM0, PLLM1 ...
        field = fields.get(label) or fields.get(f"{label}0")
        return None if field is None else value == field.position
    if label in fields:  # a bit; the lowest one of VOS, which is wider in the F429
        return value == 1 << fields[label].position and (fields[label].width == 1 or label == "VOS")
    label = word.split("_", maxsplit=1)[0]
    return value < 1 << fields[label].width if label in fields else None  # one of a field's values


def check_constants(header: Header) -> Iterator[str]:
    """Yield every constant that is wrong, or that is nowhere in the description."""
    for name, value in header.constants.items():
        if name in NO_FIELD:
            continue
        prefix, register, word = [*name.split("_", maxsplit=2), "", ""][:3]
        said = {where: _agrees(word, value, fields) for where, fields in _fields(prefix, register, header)}
        if name == "TIM_SR_ALL":
            said.pop("TIM1")  # has more of them, and TIM1_SR_ALL
        if not any(answer is not None for answer in said.values()):
            yield f"{name}: nothing like it is described"
        yield from (
            f"{name}: {value:#x} is not what {at} says" for at, answer in said.items() if answer is False
        )


def check(text: str) -> list[str]:
    """Return everything in a header that the vendor's description does not bear out."""
    header = read_header(text)
    return [
        *check_offsets(header),
        *check_constants(header),
        *(f"{name}: excepted, and not there" for name in NO_FIELD if name not in header.constants),
    ]
