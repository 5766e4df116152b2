"""RCC, PWR, FLASH, IWDG and the pins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.target.machine.block import Block

if TYPE_CHECKING:
    from tests.target.machine.system import System

HSI_HZ = 16e6
_HSE_US, _PLL_US, _FLASH_WORD_US, _FLASH_ERASE_US = 2000.0, 100.0, 16.0, 250_000.0
_STEP_HZ = 30e6  # of the flash, a wait state each
_DIVIDE_AHB = {8: 2, 9: 4, 10: 8, 11: 16, 12: 64, 13: 128, 14: 256, 15: 512}
_RESET_BITS = {
    "power": (25, 26, 27), "pin": (26,), "software": (26, 28), "watchdog": (26, 29), "brown-out": (25, 26),
}  # fmt: skip


class Rcc(Block):
    """Oscillators, PLL, buses, and the causes of a reset."""

    NAME = "RCC"

    def __init__(self, system: System, *, crystal: bool) -> None:
        self.crystal = crystal
        super().__init__(system)

    def reset_for(self, cause: str) -> None:
        """Take the values of a reset; its cause stays until the program clears it."""
        flags = 0 if cause == "power" else self.now["CSR"] & 0xFE00_0000
        self.reset()
        self.now["CSR"] = flags
        self.raise_flag("CSR", *_RESET_BITS[cause])

    def core_Hz(self) -> float:  # noqa: N802
        """Return the processor's clock."""
        source = self.field("CFGR", 2, 2)
        hz = {0: HSI_HZ, 1: self.system.board.crystal_Hz}.get(source) or self.pll_Hz()
        return hz / _DIVIDE_AHB.get(self.field("CFGR", 4, 4), 1)

    def pll_Hz(self) -> float:  # noqa: N802
        """Return the PLL's output."""
        source = self.system.board.crystal_Hz if self.flag("PLLCFGR", 22) else HSI_HZ
        entry = source / max(self.field("PLLCFGR", 0, 6), 1)
        vco = entry * self.field("PLLCFGR", 6, 9)
        if not 0.95e6 <= entry <= 2.1e6 or not 100e6 <= vco <= 432e6:
            self.misuse(f"PLL: {entry / 1e6:g} MHz in, {vco / 1e6:g} MHz inside")
        return vco / (2 * self.field("PLLCFGR", 16, 2) + 2)

    def bus_Hz(self, bus: int) -> float:  # noqa: N802
        """Return the clock of APB1 or APB2."""
        part = self.field("CFGR", 10 if bus == 1 else 13, 3)
        hz = self.core_Hz() / (1 << max(part - 3, 0))
        if hz > (42.1e6 if bus == 1 else 84.1e6):
            self.misuse(f"APB{bus} runs at {hz / 1e6:g} MHz")
        return hz

    def timer_Hz(self, bus: int) -> float:  # noqa: N802
        """Return the clock of the timers of `bus`, Hz."""
        divided = self.field("CFGR", 10 if bus == 1 else 13, 3) >= 4
        return self.bus_Hz(bus) * (2 if divided else 1)

    def write_CR(self, value: int, before: int) -> int:  # noqa: N802
        """Start and stop oscillators."""
        started = value & ~before
        if started >> 16 & 1 and self.crystal:
            self.system.after(_HSE_US, lambda: self.raise_flag("CR", 17) if self.flag("CR", 16) else None)
        if started >> 24 & 1:
            if self.flag("PLLCFGR", 22) and not before >> 17 & 1:
                self.misuse("the PLL starts on a crystal that is not ready")
            self.system.after(_PLL_US, lambda: self.raise_flag("CR", 25) if self.flag("CR", 24) else None)
        ready = before & 0x0202_0002
        for bit in (16, 24):
            if not value >> bit & 1:
                ready &= ~(1 << (bit + 1))
        return (value & ~0x0202_0002) | ready

    def write_PLLCFGR(self, value: int, before: int) -> int:  # noqa: N802
        """Refuse changes of PLLCFGR while the PLL runs."""
        if self.flag("CR", 24) and value != before:
            self.misuse("PLLCFGR changes while the PLL runs")
        return value

    def write_CFGR(self, value: int, before: int) -> int:  # noqa: N802
        """Switch the system clock if the new source is ready."""
        wanted = value & 3
        there = {0: True, 1: self.flag("CR", 17), 2: self.flag("CR", 25)}.get(wanted, False)
        if not there:
            self.misuse(f"SYSCLK goes to source {wanted}, which is not ready")
        self.now["CFGR"] = (value & ~0xC) | ((wanted if there else before & 3) << 2)
        self.system.flash.check_latency(self.core_Hz())
        self.bus_Hz(1), self.bus_Hz(2)
        return self.now["CFGR"]

    def write_CSR(self, value: int, before: int) -> int:  # noqa: N802
        """Take note of the causes."""
        flags = 0 if value >> 24 & 1 else before & 0xFE00_0000
        return flags | (value & 1) | (2 if value & 1 else 0)

    def write_CIR(self, value: int, before: int) -> int:  # noqa: N802
        """Take note of the clock security system."""
        return (before & ~0x80 if value >> 23 & 1 else before) & 0xFF

    def stop_crystal(self) -> None:
        """Stop the crystal, as by a defect."""
        self.crystal = False
        on = self.flag("CR", 19)
        self.drop_flag("CR", 17, 16, 24, 25)
        self.now["CFGR"] &= ~0xF
        if on:
            self.raise_flag("CIR", 7)
            self.system.cpu.pend(2)


class Pwr(Block):
    """The voltage regulator: it is set up, and nothing depends on it here."""

    NAME = "PWR"
    CLOCK: tuple[str, int] | None = ("APB1ENR", 28)


class Flash(Block):
    """The interface to the flash memory."""

    NAME = "FLASH"
    KEYS = (0x4567_0123, 0xCDEF_89AB)
    broken = False  # no write changes anything

    def reset(self) -> None:
        """Lock the flash."""
        super().reset()
        self._keys = 0
        self.erased = self.written = 0

    def check_latency(self, hz: float) -> None:
        """Note wait states that are too few at 2.7 V and more."""
        if self.field("ACR", 0, 3) < -(-hz // _STEP_HZ) - 1:
            self.misuse(f"{self.field('ACR', 0, 3)} wait states at {hz / 1e6:g} MHz")

    def write_KEYR(self, value: int, _: int) -> int:  # noqa: N802
        """Unlock, key by key."""
        if self._keys >= 2 or value != self.KEYS[self._keys]:
            self.misuse("a wrong key: locked until the next reset")
        self._keys += 1
        if self._keys == 2:
            self.drop_flag("CR", 31)
        return 0

    def write_SR(self, value: int, before: int) -> int:  # noqa: N802
        """Flags are cleared by ones."""
        return before & ~(value & 0xF3)

    def write_CR(self, value: int, before: int) -> int:  # noqa: N802
        """Erase a sector, or lock the flash."""
        if before >> 31 & 1:
            self.misuse("CR is written while it is locked")
            return before
        if value >> 31 & 1:
            self._keys = 0
        if value >> 16 & 1:
            sector = value >> 3 & 0xF
            if not value >> 1 & 1 or sector not in (1, 2):
                self.misuse(f"sector {sector} is erased, which holds the program")
            else:
                self.system.erase(sector)
                self.erased += 1
                self.system.stand_still(_FLASH_ERASE_US)
        return value & ~(1 << 16)

    def programmed(self, address: int, before: int, value: int, size: int) -> int:
        """Return what a write to the memory itself leaves there."""
        if not self.flag("CR", 0) or self.flag("CR", 31) or self.field("CR", 8, 2) != 2 or size != 4:
            self.misuse(f"flash at {address:#x} is written without PG, or by the wrong size")
            self.raise_flag("SR", 7)
            return before
        if value & ~before:
            self.misuse(f"flash at {address:#x} is not blank")
        self.written += 1
        self.system.stand_still(_FLASH_WORD_US)
        return before if self.broken else before & value


class Iwdg(Block):
    """The watchdog that cannot be stopped."""

    NAME = "IWDG"

    def reset(self) -> None:
        """Stand still until the program starts it."""
        super().reset()
        self.running, self._open, self._fed_us = False, False, 0.0
        self.feeds = 0

    def _lsi_us(self) -> float:
        return 1e6 / self.system.lsi_hz

    def due_us(self) -> float:
        """Return the time of the watchdog's next reset, us."""
        if not self.running:
            return float("inf")
        divider = 4 << min(self.now["PR"], 6)
        return self._fed_us + (self.now["RLR"] + 1) * divider * self._lsi_us()

    def write_KR(self, value: int, _: int) -> int:  # noqa: N802
        """Start, feed, open."""
        if value == 0xCCCC:
            self.running = True
        self._open = value == 0x5555
        if value in (0xAAAA, 0xCCCC):
            self._fed_us = self.system.now_us
            self.feeds += 1
        elif value != 0x5555:
            self.misuse(f"key {value:#x}")
        return 0

    def _change(self, register: str, value: int, before: int, busy: int) -> int:
        if not self._open or self.flag("SR", busy):
            self.misuse(f"{register} is written while it is locked or busy")
            return before
        self.raise_flag("SR", busy)
        self.system.after(5 * self._lsi_us(), lambda: self.drop_flag("SR", busy))
        return value

    def write_PR(self, value: int, before: int) -> int:  # noqa: N802
        """Change the divider, in the watchdog's own time."""
        return self._change("PR", value, before, 0)

    def write_RLR(self, value: int, before: int) -> int:  # noqa: N802
        """Change the reload."""
        return self._change("RLR", value, before, 1)


class Gpio(Block):
    """A GPIO port with sixteen pins."""

    def __init__(self, system: System, name: str) -> None:
        self.CLOCK = ("AHB1ENR", ord(name[-1]) - ord("A"))
        self.outside = 0  # levels that the world puts on the pins
        super().__init__(system, name)

    def mode(self, pin: int) -> int:
        """Return 0 input, 1 output, 2 alternate, 3 analog."""
        return self.field("MODER", 2 * pin, 2)

    def function(self, pin: int) -> int:
        """Return the alternate function that is on a pin, -1 for none."""
        register = "AFRL" if pin < 8 else "AFRH"
        return self.field(register, 4 * (pin % 8), 4) if self.mode(pin) == 2 else -1

    def level(self, pin: int, *, undriven: bool = False) -> bool:
        """Return what an output drives; what the board's resistor says of a pin that is none."""
        return self.flag("ODR", pin) if self.mode(pin) == 1 else undriven

    def read_IDR(self) -> int:  # noqa: N802
        """Return the levels."""
        value = 0
        for pin in range(16):
            driven = self.mode(pin) == 1
            value |= (self.flag("ODR", pin) if driven else self.outside >> pin & 1) << pin
        return value

    def write_BSRR(self, value: int, _: int) -> int:  # noqa: N802
        """Set and clear; setting wins."""
        self.now["ODR"] = (self.now["ODR"] & ~(value >> 16) | value) & 0xFFFF
        self.system.look_at_pins()
        return 0

    def write_ODR(self, value: int, _: int) -> int:  # noqa: N802
        """Set the output pins."""
        self.now["ODR"] = value
        self.system.look_at_pins()
        return value

    def write_MODER(self, value: int, _: int) -> int:  # noqa: N802
        """Change the mode of the pins."""
        self.now["MODER"] = value
        self.system.look_at_pins()
        return value
