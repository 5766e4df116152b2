"""A peripheral as a block of registers that knows what may not be done to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.target.machine.svd import description

if TYPE_CHECKING:
    from tests.target.machine.system import System


class Block:
    """Registers by name; what the firmware reads and writes goes through here.

    A subclass gives `read_NAME()` and `write_NAME(value, before)` for registers that do something; the latter
    returns what the register holds then.
    """

    NAME = ""
    CLOCK: tuple[str, int] | None = None
    """The register of RCC and the bit that lets this one work."""

    def __init__(self, system: System, name: str = "") -> None:
        self.system = system
        self.name = name or self.NAME
        self.base, self.registers = description()[self.name]
        self.offsets = {register.name: offset for offset, register in self.registers.items()}
        self.now: dict[str, int] = {}
        self.reset()

    def reset(self) -> None:
        """Take the values of a reset."""
        self.now = {register.name: register.reset for register in self.registers.values()}

    def misuse(self, what: str) -> None:
        """Record an access that no program may make."""
        self.system.misuse.append(
            f"{self.name}: {what}, at {self.system.now_us:.1f} us, pc {self.system.pc():#x}"
        )

    def is_clocked(self) -> bool:
        """Return whether RCC supplies the block's clock."""
        if self.CLOCK is None:
            return True
        register, bit = self.CLOCK
        return bool(self.system.rcc.now[register] >> bit & 1)

    def load(self, offset: int, size: int) -> int:
        """Let the firmware read."""
        register = self._find(offset, size)
        if register is None or not self.is_clocked():
            if register is not None:
                self.misuse(f"{register} is read without a clock")
            return 0
        read = getattr(self, f"read_{register}", None)
        return read() if read else self.now[register]

    def store(self, offset: int, size: int, value: int) -> None:
        """Let the firmware write."""
        register = self._find(offset, size)
        if register is None:
            return
        if not self.is_clocked():
            self.misuse(f"{register} is written without a clock")
            return
        known = self.registers[offset]
        before = self.now[register]
        if known.read_only:
            self.misuse(f"{register} is read-only")
            return
        if (value ^ known.reset) & ~known.bits:
            self.misuse(f"{register}: reserved bits in {value:#x}")
        write = getattr(self, f"write_{register}", None)
        self.now[register] = write(value, before) if write else value

    def _find(self, offset: int, size: int) -> str | None:
        register = self.registers.get(offset)
        if register is None:
            self.misuse(f"nothing at offset {offset:#x}")
            return None
        if size != 4:
            self.misuse(f"{register.name} in {size} bytes")
        return register.name

    def flag(self, register: str, bit: int) -> bool:
        """Return a bit."""
        return bool(self.now[register] >> bit & 1)

    def field(self, register: str, at: int, width: int) -> int:
        """Return a field of a register."""
        return self.now[register] >> at & ((1 << width) - 1)

    def raise_flag(self, register: str, *bits: int) -> None:
        """Set flags of a register."""
        for bit in bits:
            self.now[register] |= 1 << bit

    def drop_flag(self, register: str, *bits: int) -> None:
        """Clear flags of a register."""
        for bit in bits:
            self.now[register] &= ~(1 << bit)
