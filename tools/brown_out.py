"""The brown-out reset of a board's chip: what its option word says, and what may be written into it.

The firmware writes flash memory 32 bits at a time, for which an STM32F405 needs 2.7 V. Brown-out level 3
keeps the chip in reset below that (RM0090, sections 3.6 and 5.2.2). A new chip has the level off, and works
down to 1.8 V.

A mistake in this word is for ever: a read protection (RDP) of 0xCC locks the chip. So BOR_LEV is all that
ever changes, and only where RDP is 0xAA. Power that goes while the word is written leaves no 0xCC either: the
word is erased to ones first, and the way from 0xFF to 0xAA clears neither bit 1 nor bit 5, both 0 in 0xCC.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pathlib import Path

OPTKEYR_ADDRESS, OPTCR_ADDRESS = 0x4002_3C08, 0x4002_3C14
OPTION_BYTES_ADDRESS = 0x1FFF_C000
OPTION_KEYS = (0x0819_2A3B, 0x4C5D_6E7F)
LOCK_BIT, START_BIT = 1 << 0, 1 << 1
COMMANDS = LOCK_BIT | START_BIT
RESERVED_BITS = 0xF000_0010  # 0 in every STM32F405
BOR_LEV_BITS = 0b11 << 2  # 0b11: off, 0b10: level 1, 0b01: level 2, 0b00: level 3
_RDP_SHIFT_BITS, _RDP_NONE, _RDP_LOCKED = 8, 0xAA, 0xCC
_LEVEL_NAMES = {0b11: "off", 0b10: "level 1", 0b01: "level 2", 0b00: "level 3"}

DHCSR_ADDRESS, HALTED_BIT = 0xE000_EDF0, 1 << 17  # of the processor's debug unit
FREEZE_ADDRESS, FREEZE_IWDG_BIT = 0xE004_2008, 1 << 12  # the watchdog stands still with the processor
WORD_BYTES = 4
_WRITE_TIMEOUT_MS = 2000  # more than an erase of the option bytes takes


class OptionError(RuntimeError):
    """An option word that is not written."""


class Write(NamedTuple):
    """A word that goes into a register."""

    address: int
    value: int


def is_open(word: int) -> bool:
    """Return whether a word that was read is that of a chip without read protection."""
    return word >> _RDP_SHIFT_BITS & 0xFF == _RDP_NONE


def level(word: int) -> str:
    """Return the name of an option word's brown-out level."""
    return _LEVEL_NAMES[(word & BOR_LEV_BITS) >> 2]


def planned(word: int) -> int | None:
    """Return the settings to write for an option word that was read; None where it has level 3.

    Every bit but BOR_LEV is as it was read; OPTLOCK and OPTSTRT are commands, and 0 here.

    Raises
    ------
    OptionError
        If the chip is protected against reading, the word cannot be that of an STM32F405, or a write was
        begun and not ended: then the register holds what was to be written, and not what the chip will do.
    """
    protection = word >> _RDP_SHIFT_BITS & 0xFF
    if protection == _RDP_LOCKED:
        raise OptionError(
            f"option word {word:#010x}: the chip is locked for ever (RDP level 2). Nothing was written; use "
            "another chip."
        )
    if protection != _RDP_NONE:
        raise OptionError(
            f"option word {word:#010x}: RDP is {protection:#04x}, not 0xaa. The chip is protected against "
            "reading, or the word was not read rightly. Nothing was written. Look at the wires and the "
            "supply, and try again. This program ends no protection: that erases all that is in the chip."
        )
    if word & RESERVED_BITS:
        raise OptionError(
            f"option word {word:#010x}: bits are set that are 0 in an STM32F405, so the word was not read "
            "rightly, or the chip is another. Nothing was written. Look at the wires, and try again."
        )
    if word & COMMANDS != LOCK_BIT:
        raise OptionError(
            f"option word {word:#010x}: a write was begun and not ended. Nothing was written now. Switch the "
            "board's supply off and on, and call this again."
        )
    if not word & BOR_LEV_BITS:
        return None
    return word & ~COMMANDS & ~BOR_LEV_BITS


def writes(settings: int) -> list[Write]:
    """Return what puts settings into the option word: unlock, write, start; lock it again after that."""
    return [
        *(Write(OPTKEYR_ADDRESS, key) for key in OPTION_KEYS),
        Write(OPTCR_ADDRESS, settings),
        Write(OPTCR_ADDRESS, settings | START_BIT),
        Write(OPTCR_ADDRESS, settings | LOCK_BIT),
    ]


def check_written(settings: int, word: int) -> None:
    """Compare what was written with what is read after the reset.

    Raises
    ------
    OptionError
        If they differ.
    """
    if (settings ^ word) & ~COMMANDS:
        raise OptionError(
            f"option word {word:#010x} after it was written, expected {settings | LOCK_BIT:#010x}. Nothing "
            "else was written. Switch the board's supply off and on, and try again."
        )


# --------------------------------------------------------------------------------- by pyocd, by stm32flash


def _commander(*commands: str, held: bool = False) -> list[str]:
    hold = ["-O", "resume_on_disconnect=false"] if held else []
    given = [word for command in commands for word in ("-c", command)]
    return ["pyocd", "commander", "--target", "stm32f405rg", *hold, *given]


def read_by_probe(file: Path) -> list[str]:
    """Return the command that reads the option word into a file, over a debug probe."""
    return _commander(f"savemem {OPTCR_ADDRESS:#x} {WORD_BYTES} {file}")


def hold_by_probe(file: Path) -> list[str]:
    """Return the command that halts the chip before its first instruction; DHCSR in a file shows it."""
    freeze = f"write32 {FREEZE_ADDRESS:#x} {FREEZE_IWDG_BIT:#x}"
    return _commander("reset halt", freeze, f"savemem {DHCSR_ADDRESS:#x} {WORD_BYTES} {file}", held=True)


def write_by_probe(settings: int) -> list[str]:
    """Return the command that writes settings into the option word of a halted chip, and resets it."""
    *first, lock = (f"write32 {write.address:#x} {write.value:#010x}" for write in writes(settings))
    return _commander(*first, f"sleep {_WRITE_TIMEOUT_MS}", lock, "reset", held=True)


def read_by_boot_loader(file: Path, talk: list[str], port: str) -> list[str]:
    """Return the command that reads the option bytes into a file, over the chip's own boot loader."""
    return [*talk, "-r", str(file), "-S", f"{OPTION_BYTES_ADDRESS:#x}:{WORD_BYTES}", port]
