"""The bus: which block or which register of the processor answers at an address outside memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tests.target.machine.block import Block
    from tests.target.machine.system import System

_PERIPHERALS, _PRIVATE = 0x4000_0000, 0xE000_0000


class Bus:
    """Leads what a program reads and writes to the blocks of a system and to its processor."""

    def __init__(self, system: System) -> None:
        self._system = system

    def map(self, uc: Any) -> None:
        """Have an emulator ask here."""
        uc.mmio_map(_PERIPHERALS, 0x8_0000, self.load, None, self.store, None)
        uc.mmio_map(_PRIVATE, 0x10_0000, self._load_private, None, self._store_private, None)

    def load(self, _: Any, offset: int, size: int, __: object) -> int:
        block = self._block(offset)
        return block.load(_PERIPHERALS + offset - block.base, size) & 0xFFFF_FFFF if block else 0

    def store(self, _: Any, offset: int, size: int, value: int, __: object) -> None:
        block = self._block(offset)
        if block:
            block.store(_PERIPHERALS + offset - block.base, size, value)

    def _block(self, offset: int) -> Block | None:
        block = self._system.blocks.get((_PERIPHERALS + offset) >> 10)
        if block is None:
            self._system.misuse.append(f"nothing is at {_PERIPHERALS + offset:#x}")
        return block

    def _load_private(self, _: Any, offset: int, __: int, ___: object) -> int:
        return self._system.cpu.load(offset)

    def _store_private(self, _: Any, offset: int, size: int, value: int, __: object) -> None:
        self._system.cpu.store(offset, size, value)
