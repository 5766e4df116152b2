"""The processor around unicorn: exceptions, their priorities, and the system control block."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from unicorn import arm_const as arm

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.target.machine.system import System

RETURN = 0xFFFF_FFF8  # where every exception goes when it is over
_LINK = 0xFFFF_FFF9
_FRAME = (
    arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12,
    arm.UC_ARM_REG_LR, arm.UC_ARM_REG_PC, arm.UC_ARM_REG_XPSR,
)  # fmt: skip
_IDLE = 0x100  # below every priority
_FIXED = {2: -2, 3: -1}
NMI, HARD_FAULT = 2, 3


class Cpu:
    """Registers through unicorn, exceptions by hand."""

    def __init__(self, uc: Any, system: System) -> None:
        self.uc, self.system = uc, system
        self.reset()

    def reset(self) -> None:
        """Reset the state of exceptions: none active, none pending."""
        self.enabled: set[int] = set()
        self.pending: set[int] = set()
        self.lines: dict[int, Callable[[], bool]] = {}
        self.priority: dict[int, int] = {}
        self.active: list[int] = []
        self.vtor = 0
        self.masked: set[int] = set()  # lines that something broke
        self.counts: dict[int, list[int]] = {}
        self._began: list[int] = []

    # ------------------------------------------------------------------------------ interrupts in

    def line(self, irq: int, is_up: Callable[[], bool]) -> None:
        """Let a peripheral's line ask for its interrupt, for as long as it is up."""
        self.lines[irq] = is_up
        if irq not in self.masked:
            self.pend(16 + irq)

    def pend(self, number: int) -> None:
        """Mark an exception as pending."""
        self.pending.add(number)
        self.system.interrupt_now()

    def _level(self, number: int) -> int:
        return _FIXED.get(number, self.priority.get(number, 0))

    def now_at(self) -> int:
        """Return the current priority of the processor."""
        return min((self._level(number) for number in self.active), default=_IDLE)

    def next(self) -> int | None:
        """Return the exception that would come now, for any PRIMASK."""
        ready = [n for n in self.pending if n < 16 or n - 16 in self.enabled]
        if not ready:
            return None
        first = min(ready, key=lambda n: (self._level(n), n))
        return first if self._level(first) < self.now_at() else None

    def may_enter(self) -> int | None:
        """Return the exception to enter now; None if there is none."""
        first = self.next()
        if first is None or (first > HARD_FAULT and self.uc.reg_read(arm.UC_ARM_REG_PRIMASK) & 1):
            return None
        return first

    # ------------------------------------------------------------------------------ entry and exit

    def enter(self, number: int) -> None:
        """Save what the manual says, and go to the handler."""
        uc = self.uc
        stack = uc.reg_read(arm.UC_ARM_REG_SP)
        aligned = (stack - 32) & ~7
        values = [uc.reg_read(register) for register in _FRAME]
        values[7] = (values[7] & ~0x200) | (0x200 if stack & 4 else 0)
        frame = b"".join(value.to_bytes(4, "little") for value in values)
        try:
            uc.mem_write(aligned, frame)
        except Exception:  # noqa: BLE001 - unicorn's own: the stack is not in any memory
            self.system.faults.append(f"exception {number} finds no stack at {aligned:#x}")
        uc.reg_write(arm.UC_ARM_REG_SP, aligned)
        uc.reg_write(arm.UC_ARM_REG_LR, _LINK)
        self.pending.discard(number)
        self.active.append(number)
        self._began.append(self.system.instructions)
        self.system.note_stack(aligned)
        vector = int.from_bytes(uc.mem_read(self.vtor + 4 * number, 4), "little")
        if not vector & 1 and number != HARD_FAULT:
            self.system.faults.append(f"exception {number} has no handler")
            self.active.pop()
            self._began.pop()
            self.pending.add(HARD_FAULT)
            return
        self.system.jump(vector)

    def leave(self) -> None:
        """Return from the exception."""
        uc = self.uc
        stack = uc.reg_read(arm.UC_ARM_REG_SP)
        frame = bytes(uc.mem_read(stack, 32))
        values = [int.from_bytes(frame[4 * i : 4 * i + 4], "little") for i in range(8)]
        number = self.active.pop()
        self.counts.setdefault(number, []).append(self.system.instructions - self._began.pop())
        uc.reg_write(arm.UC_ARM_REG_SP, stack + 32 + (4 if values[7] & 0x200 else 0))
        for register, value in zip(_FRAME, values, strict=True):
            if register not in (arm.UC_ARM_REG_PC, arm.UC_ARM_REG_XPSR):
                uc.reg_write(register, value)
        uc.reg_write(arm.UC_ARM_REG_XPSR, values[7] & 0xFE00_FC00 | 0x0100_0000)
        self.system.jump(values[6] | 1)
        is_up = self.lines.get(number - 16)
        if is_up is not None and is_up() and number - 16 not in self.masked:
            self.pend(number)  # a level: it is still there

    # ---------------------------------------------------------------------- its own registers

    def load(self, offset: int) -> int:
        """Let the firmware read what is at 0xE0000000 and above."""
        if offset == 0xED08:
            return self.vtor
        if offset == 0xED0C:
            return 0xFA05_0000
        return 0

    def store(self, offset: int, size: int, value: int) -> None:
        """Let the firmware write there."""
        if 0xE100 <= offset < 0xE500:
            self._store_nvic(offset - 0xE100, size, value)
        elif offset == 0xED08:
            self.vtor = value
        elif offset == 0xED0C and value >> 16 == 0x05FA and value & 4:
            self.system.ask_for_reset("software")
        else:
            self.system.misuse.append(f"the processor's own register {offset:#x} is written")
        self.system.interrupt_now()

    def _store_nvic(self, offset: int, size: int, value: int) -> None:
        register, within = offset & ~0x7F, offset & 0x7F
        if register == 0x000:
            self.enabled |= self._numbers(within, value)
        elif register == 0x080:
            self.enabled -= self._numbers(within, value)
        elif register == 0x100:
            for irq in self._numbers(within, value) - self.masked:
                self.pend(16 + irq)
        elif offset >= 0x300:
            for byte in range(size):
                self.priority[16 + offset - 0x300 + byte] = value >> (8 * byte) & 0xF0
        else:
            self.system.misuse.append(f"the interrupt controller's register {offset:#x} is written")

    @staticmethod
    def _numbers(offset: int, value: int) -> set[int]:
        return {8 * offset + bit for bit in range(32) if value >> bit & 1}
