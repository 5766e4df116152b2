"""A chip behind programmers that are not there: `pyocd` and `stm32flash` as scripts, which keep it in a file.

The option word behaves as RM0090 says: two keys unlock it until a reset, OPTSTRT carries out what was
written, a wrong key locks it. Anything else that is asked ends the script with an error.
"""

from __future__ import annotations

import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

OPTKEYR_ADDRESS, OPTCR_ADDRESS = 0x4002_3C08, 0x4002_3C14
DHCSR_ADDRESS, FREEZE_ADDRESS = 0xE000_EDF0, 0xE004_2008
OPTION_KEYS = [0x0819_2A3B, 0x4C5D_6E7F]
LOCK_BIT, START_BIT, HALTED_BIT = 1, 2, 1 << 17


def install(folder: Path, word: int, **chip: Any) -> Path:
    """Put both programmers into a folder; return the file with the chip."""
    kept = folder / "chip.json"
    fresh = {
        "stored": word | LOCK_BIT,
        "optcr": word | LOCK_BIT,
        "keys": 0,
        "halted": False,
        "started": [],
        "flashed": [],
    }
    kept.write_text(
        json.dumps({**fresh, "halts": True, "stubborn": False, "short": False, "dies": 99, **chip})
    )
    for name in ("pyocd", "stm32flash"):
        tool = folder / name
        tool.write_text(f'#!/bin/sh\nexec {sys.executable} {__file__} {name} {kept} "$@"\n')
        tool.chmod(0o755)
    return kept


def chip(kept: Path) -> dict[str, Any]:
    """Return the chip as it is now."""
    found = json.loads(kept.read_text())
    assert isinstance(found, dict)
    return found


def reset(chip: dict[str, Any], *, halt: bool) -> None:
    chip |= {"optcr": chip["stored"] | LOCK_BIT, "keys": 0, "halted": halt and chip["halts"]}


def write(chip: dict[str, Any], address: int, value: int) -> None:
    if address == OPTKEYR_ADDRESS:
        good = chip["keys"] < len(OPTION_KEYS) and value == OPTION_KEYS[chip["keys"]]
        chip["keys"] = chip["keys"] + 1 if good else len(OPTION_KEYS) + 1
        if chip["keys"] == len(OPTION_KEYS):
            chip["optcr"] &= ~LOCK_BIT
    elif address == OPTCR_ADDRESS:
        assert not chip["optcr"] & LOCK_BIT, "the option word is written while it is locked"
        if value & START_BIT:
            assert chip["halted"], "a program runs that could disturb it"
            assert value & ~START_BIT == chip["optcr"], "started with other settings than were written"
            chip["started"].append(value & ~START_BIT)
            chip["stored"] = chip["stored"] if chip["stubborn"] else value & ~(START_BIT | LOCK_BIT)
        chip["optcr"] = value & ~START_BIT
    else:
        assert address == FREEZE_ADDRESS, hex(address)


def save(chip: dict[str, Any], address: int, length: int, file: str) -> None:
    word = {OPTCR_ADDRESS: chip["optcr"], DHCSR_ADDRESS: HALTED_BIT if chip["halted"] else 0}[address]
    Path(file).write_bytes(word.to_bytes(4, "little")[: 1 if chip["short"] else length])


def pyocd(chip: dict[str, Any], words: list[str]) -> int:
    """Carry out the commands up to the one at which the probe is pulled out; return the exit code."""
    verb, *rest = words
    if verb == "flash":
        chip["flashed"].append(rest[rest.index("--base-address") + 1])
        return 0
    assert verb == "commander", verb
    assert rest[:2] == ["--target", "stm32f405rg"]
    held = "resume_on_disconnect=false" in rest
    for command in (after for word, after in pairwise(rest) if word == "-c"):
        name, *arguments = command.split()
        if name == "write32":
            chip["dies"] -= 1
            if chip["dies"] < 0:  # the probe is pulled out
                return 1
            write(chip, *(int(argument, 0) for argument in arguments))
        elif name == "savemem":
            save(chip, int(arguments[0], 0), int(arguments[1]), arguments[2])
        elif name == "reset":
            reset(chip, halt=arguments == ["halt"])
        else:
            assert name == "sleep", name
    chip["halted"] = chip["halted"] and held
    return 0


def stm32flash(chip: dict[str, Any], words: list[str]) -> int:
    """Read the option bytes, write a piece, or start the program; return the exit code."""
    if "-r" in words:
        assert words[words.index("-S") + 1] == "0x1fffc000:4"
        data = (chip["stored"] & 0xFFEC | 0xABCD_0000).to_bytes(4, "little")
        Path(words[words.index("-r") + 1]).write_bytes(data[: 1 if chip["short"] else 4])
    elif "-w" in words:
        chip["flashed"].append(words[words.index("-S") + 1])
    else:
        assert "-g" in words
    return 0


if __name__ == "__main__":
    tool, at, *given = sys.argv[1:]
    now = chip(Path(at))
    code = {"pyocd": pyocd, "stm32flash": stm32flash}[tool](now, given)
    Path(at).write_text(json.dumps(now))
    sys.exit(code)
