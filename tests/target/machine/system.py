"""The machine: memory, time, what is on the pins, and the way in and out for a test."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

import unicorn
from unicorn import (
    UC_ARCH_ARM,
    UC_HOOK_BLOCK,
    UC_HOOK_CODE,
    UC_HOOK_INTR,
    UC_HOOK_MEM_WRITE,
    UC_MODE_MCLASS,
    UC_MODE_THUMB,
)
from unicorn import arm_const as arm

from tests.target.machine.agenda import Agenda
from tests.target.machine.bus import Bus
from tests.target.machine.clocks import Flash, Gpio, Iwdg, Pwr, Rcc
from tests.target.machine.cpu import HARD_FAULT, RETURN, Cpu
from tests.target.machine.memory import FLASH, FLASH_BYTES, blank, lay_out, lose_ram
from tests.target.machine.ports import Can, Dac, Usart
from tests.target.machine.stage import Stage
from tests.target.machine.timers import EncoderTimer, PwmTimer, Timer
from tests.target.machine.wires import Wires
from tools.boards import read_boards

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.target.machine.block import Block
    from tools.boards import Board

_EMULATOR: Any = unicorn  # its functions have no types
STACK_TOP_OF_BOARD = 0x2000_1000
_WFI = b"\x30\xbf"
_RETURNS = 8  # unicorn's number for the end of an exception
_SLICE_INSTRUCTIONS = 2000  # instructions at most between two checks of the time


class System:
    """A bench board.

    Parameters
    ----------
    elf
        Its program, as it would be flashed.
    record
        What is in sectors 1 and 2; blank by default.
    crystal
        Whether the crystal swings.
    lsi_hz
        Hz, of the watchdog's oscillator: 17 to 47 kHz.
    preempt
        Let interrupts come between any two instructions, by this seed. None: where a block of code begins.
    exact
        Count every instruction, one by one, instead of taking them from the length of a block.
    supply_mV, full_scale_mV
        mV: the motor's supply of a bridge; what 2048 codes of the DAC are behind the outer stage.
    board
        Whose wires it has; None: the board of firmware/boards that the program is named after.
    """

    def __init__(
        self, elf: Path, record: bytes = b"", *, crystal: bool = True, lsi_hz: float = 32_000.0,
        preempt: int | None = None, exact: bool = False, supply_mV: float = 10_000.0,
        full_scale_mV: float = 10_000.0, board: Board | None = None,
    ) -> None:  # fmt: skip
        self.lsi_hz = lsi_hz
        self.board = board or read_boards()[elf.stem]
        self.stage = Stage(self, supply_mV=supply_mV, full_scale_mV=full_scale_mV)
        self.chance = random.Random(preempt) if preempt is not None else None
        self.exact = exact
        self.now_us, self.instructions = 0.0, 0
        self._look, self._leaves, self._held = False, False, False
        self.misuse: list[str] = []
        self.faults: list[str] = []
        self.resets: list[tuple[float, str]] = []
        self.pins_seen: list[tuple[float, bool, float]] = []
        self.lowest_stack = STACK_TOP_OF_BOARD
        self.position: Callable[[float], int] = lambda _: 0
        self.starved = False
        self._agenda = Agenda()
        self._asleep, self._reset_for = False, ""
        self.uc: Any = _EMULATOR.Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        self.bus = Bus(self)
        self._map(elf, record)
        self.cpu = Cpu(self.uc, self)
        self.rcc = Rcc(self, crystal=crystal)
        self.flash, self.iwdg, self.pwr = Flash(self), Iwdg(self), Pwr(self)
        self.gpio = {letter: Gpio(self, f"GPIO{letter}") for letter in "ABCDEFG"}
        self.wires = Wires(self.board, self.gpio)
        self.wires.drive("BREAK", high=True)  # the bridge's failure line rests high
        self.timers: dict[str, Timer] = {name: Timer(self, name) for name in ("TIM3", "TIM5")}
        self.encoder, self.pwm = EncoderTimer(self, "TIM2"), PwmTimer(self)
        self.timers |= {"TIM2": self.encoder, "TIM1": self.pwm}
        self.usart, self.dac, self.can = Usart(self), Dac(self), Can(self)
        self.blocks: dict[int, Block] = {}
        for block in (
            self.rcc, self.flash, self.iwdg, self.pwr, *self.gpio.values(), *self.timers.values(), self.usart,
            self.dac, self.can,
        ):  # fmt: skip
            self.blocks[block.base >> 10] = block
        self.reset("power")

    def _map(self, elf: Path, record: bytes) -> None:
        uc = self.uc
        lay_out(uc, elf, record)
        self.bus.map(uc)
        uc.hook_add(UC_HOOK_BLOCK, self._block)
        if self.exact:
            uc.hook_add(UC_HOOK_CODE, self._instruction)
        uc.hook_add(UC_HOOK_INTR, self._trap)
        uc.hook_add(UC_HOOK_MEM_WRITE, self._program, begin=FLASH, end=FLASH + FLASH_BYTES - 1)

    # ------------------------------------------------------------------------------- flash memory

    def _program(self, uc: Any, _: int, address: int, size: int, value: int, __: object) -> None:
        before = int.from_bytes(uc.mem_read(address, 4), "little")
        left = self.flash.programmed(address, before, value & 0xFFFF_FFFF, size)
        self.at_once(lambda: uc.mem_write(address, left.to_bytes(4, "little")))

    def erase(self, sector: int) -> None:
        """Blank a sector of the flash memory."""
        blank(self.uc, sector)

    # --------------------------------------------------------------------------------------- time

    def after(self, us: float, deed: Callable[[], object]) -> None:
        """Have something happen later."""
        self._agenda.add(self.now_us + us, deed)

    def at_once(self, deed: Callable[[], object]) -> None:
        """Have something happen as soon as this instruction is over."""
        self.after(0.0, deed)
        self.interrupt_now()

    def stand_still(self, us: float) -> None:
        """Let time pass in which the processor does nothing, not even take interrupts."""
        self.now_us += us

    def interrupt_now(self) -> None:
        """Ask for a check where the next block begins; unicorn repeats what is stopped midway."""
        self._look = True

    def pc(self) -> int:
        """Return where the processor is."""
        return int(self.uc.reg_read(arm.UC_ARM_REG_PC))

    def jump(self, address: int) -> None:
        """Go on there."""
        self._pc = address | 1
        self.uc.reg_write(arm.UC_ARM_REG_PC, address | 1)

    def note_stack(self, at: int) -> None:
        """Record the deepest stack."""
        self.lowest_stack = min(self.lowest_stack, at)

    def _spend(self, instructions: int) -> None:
        self.instructions += instructions
        self.now_us += 1e6 * instructions / self._core_Hz

    def _block(self, uc: Any, _: int, size: int, __: object) -> None:
        if not self.exact:
            self._spend(max(size // 3, 1))  # bytes: instructions take two or four
        if self._held and not uc.reg_read(arm.UC_ARM_REG_PRIMASK) & 1:
            self._look = True  # what was masked comes now
        if self._look or self._agenda.next_us <= self.now_us:
            self._look = False
            uc.emu_stop()

    def _instruction(self, _: Any, __: int, ___: int, ____: object) -> None:
        self._spend(1)

    def _trap(self, uc: Any, number: int, _: object) -> None:
        if number == _RETURNS:
            self._leaves = True
        else:
            self.faults.append(f"trap {number} at {self.pc():#x}")
            self.cpu.pending.add(HARD_FAULT)
        uc.emu_stop()

    def run_until(self, us: float) -> None:
        """Let the board work until then."""
        while self.now_us < us:
            self._happen()
            if self._reset_for:
                self._restart()
            entered = self.cpu.may_enter()
            self._held = entered is None and self.cpu.next() is not None
            if entered is not None:
                self._asleep = False
                self.cpu.enter(entered)
            elif self._held:
                self._asleep = False
            if self._asleep or (self.starved and not self.cpu.active):
                self._sleep(us)
            else:
                self._execute()

    def run_for(self, us: float) -> None:
        """Run the board for `us` microseconds."""
        self.run_until(self.now_us + us)

    def _sleep(self, us: float) -> None:
        self.now_us = max(self.now_us, min(us, self._agenda.next_us, self.iwdg.due_us()))

    def _happen(self) -> None:
        if self.now_us >= self.iwdg.due_us():
            self.ask_for_reset("watchdog")
        while self._agenda.next_us <= self.now_us:
            self._agenda.take()()

    def _execute(self) -> None:
        self._core_Hz = self.rcc.core_Hz()
        count = self.chance.randint(1, 400) if self.chance else 0
        begin = self.instructions
        try:
            self.uc.emu_start(self._pc, RETURN, count=count)
        except _EMULATOR.UcError as error:
            self.faults.append(f"{error} at {self.pc():#x}")
            self.cpu.pending.add(HARD_FAULT)
        if self.instructions == begin:
            self._spend(1)
        pc = self.pc()
        self.note_stack(int(self.uc.reg_read(arm.UC_ARM_REG_SP)))
        self._pc = pc | 1
        self._asleep = FLASH < pc < FLASH + FLASH_BYTES and self.uc.mem_read((pc & ~1) - 2, 2) == _WFI
        if self._leaves or pc & ~1 == RETURN:
            self._leaves = False
            self.cpu.leave()

    # -------------------------------------------------------------------------------------- resets

    def ask_for_reset(self, cause: str) -> None:
        """Have the chip start again, as soon as this instruction is over."""
        self._reset_for = cause
        self.interrupt_now()

    def _restart(self) -> None:
        cause, self._reset_for = self._reset_for, ""
        self.reset(cause)

    def reset(self, cause: str) -> None:
        """Start again: power, pin, software, watchdog, brown-out. The RAM is lost with the power alone."""
        self.resets.append((self.now_us, cause))
        if cause == "power":
            lose_ram(self.uc, len(self.resets))
        self._agenda = Agenda()
        self._asleep = False
        for block in self.blocks.values():
            if block is not self.rcc:
                block.reset()
        self.rcc.reset_for(cause)
        self.cpu.reset()
        self.cpu.vtor = FLASH
        self.uc.reg_write(arm.UC_ARM_REG_PRIMASK, 0)
        stack, start = (int.from_bytes(self.uc.mem_read(FLASH + at, 4), "little") for at in (0, 4))
        self.uc.reg_write(arm.UC_ARM_REG_SP, stack)
        self._pc = start
        self._core_Hz = self.rcc.core_Hz()
        self.look_at_pins()

    # ---------------------------------------------------------------------------------------- pins

    def trigger(self, name: str) -> None:
        """Let the trigger output of a timer reach the others."""
        if name == "TIM3":
            self.encoder.turn(self.position(self.now_us))
        for timer in self.timers.values():
            if timer.name != name and timer.is_clocked():
                timer.triggered_by(name)

    @property
    def enable(self) -> bool:
        """The level of ENABLE; its resistor pulls it down."""
        return self.stage.enable

    @property
    def amplifier_mV(self) -> float:
        """Voltage at the motor, mV."""
        return self.stage.amplifier_mV

    def look_at_pins(self) -> None:
        """Record a change of the voltage at the motor."""
        now = (self.enable, self.amplifier_mV)
        if not self.pins_seen or self.pins_seen[-1][1:] != now:
            self.pins_seen.append((self.now_us, *now))
