"""Flash and RAM, and their contents."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

from elftools.elf.elffile import ELFFile
from unicorn.unicorn_const import UC_PROT_ALL

from tests.target.machine.cpu import RETURN

if TYPE_CHECKING:
    from pathlib import Path

FLASH, FLASH_BYTES, RAM, RAM_BYTES = 0x0800_0000, 1 << 20, 0x2000_0000, 0x2_0000
_SECTOR = {1: (0x4000, 0x4000), 2: (0x8000, 0x4000)}
_PAGE, _NOP = 0x1000, b"\x00\xbf"


def lay_out(uc: Any, elf: Path, record: bytes) -> None:
    """Map the memory; a program, and a record in sectors 1 and 2."""
    uc.mem_map(FLASH, FLASH_BYTES, UC_PROT_ALL)
    uc.mem_map(RAM, RAM_BYTES, UC_PROT_ALL)
    uc.mem_map(RETURN & ~(_PAGE - 1), _PAGE, UC_PROT_ALL)
    uc.mem_write(RETURN & ~(_PAGE - 1), _NOP * (_PAGE // 2))
    uc.mem_write(FLASH, b"\xff" * FLASH_BYTES)
    with elf.open("rb") as file:
        for segment in ELFFile(file).iter_segments():
            if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                uc.mem_write(segment["p_paddr"], segment.data())
    uc.mem_write(FLASH + _SECTOR[1][0], record)


def blank(uc: Any, sector: int) -> None:
    """Erase a sector."""
    start, length = _SECTOR[sector]
    uc.mem_write(FLASH + start, b"\xff" * length)


def lose_ram(uc: Any, seed: int) -> None:
    """Fill the RAM with what a power-on leaves there."""
    uc.mem_write(RAM, random.Random(seed).randbytes(RAM_BYTES))


def sector(uc: Any, number: int) -> bytes:
    """Return what is in sector 1 or 2."""
    start, length = _SECTOR[number]
    return bytes(uc.mem_read(FLASH + start, length))
