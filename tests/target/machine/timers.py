"""The timers as this board may use them: sample clock, microseconds, encoder, PWM with its break."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.target.machine.block import Block

if TYPE_CHECKING:
    from tests.target.machine.system import System

_UINT32_MAX = 0xFFFF_FFFF
_IRQ = {"TIM3": 29, "TIM5": 50, "TIM2": 28}
_WIDE = ("TIM2", "TIM5")
TRGO_OF = {("TIM2", 2): "TIM3", ("TIM5", 0): "TIM2", ("TIM2", 0): "TIM1", ("TIM5", 1): "TIM3"}
"""Which timer's trigger output is behind an internal trigger input (RM0090, tables of ITRx)."""


class Timer(Block):
    """A timer driven by its clock."""

    def __init__(self, system: System, name: str) -> None:
        bits = {"TIM2": 0, "TIM3": 1, "TIM5": 3}
        self.CLOCK = ("APB1ENR", bits[name]) if name in bits else ("APB2ENR", 0)
        self.bus = 1 if name in bits else 2
        super().__init__(system, name)

    def reset(self) -> None:
        """Stop the timer."""
        super().reset()
        self.now["ARR"] = _UINT32_MAX if self.name in _WIDE else 0xFFFF
        self._prescaler = 0  # in use; PSC comes in at an update
        self._since_us, self._from = 0.0, 0
        self._round = 0

    def period_us(self) -> float:
        """Return the time of one count, us."""
        return 1e6 * (self._prescaler + 1) / self.system.rcc.timer_Hz(self.bus)

    def count(self) -> int:
        """Return CNT now."""
        if not self.flag("CR1", 0):
            return self._from
        counts = int((self.system.now_us - self._since_us) / self.period_us() + 1e-6)
        return (self._from + counts) % (self.now["ARR"] + 1)

    def _restart(self, count: int) -> None:
        self._since_us, self._from = self.system.now_us, count
        self._round += 1
        if self.flag("CR1", 0) and self.now["ARR"] < 0xFFFF_FFFF:
            this = self._round
            left = (self.now["ARR"] + 1 - count) * self.period_us()
            self.system.after(left, lambda: self._update() if this == self._round else None)

    def _update(self) -> None:
        self._prescaler = self.now["PSC"]
        self.raise_flag("SR", 0)
        if self.flag("DIER", 0) and self.name in _IRQ:
            self.system.cpu.line(_IRQ[self.name], self.is_pending)
        if self.field("CR2", 4, 3) == 2:
            self.system.trigger(self.name)
        self._restart(0)

    def is_pending(self) -> bool:
        """Whether its interrupt line is up."""
        return bool(self.now["SR"] & self.now["DIER"] & 0xFF)

    def read_CNT(self) -> int:  # noqa: N802
        """Return the count."""
        return self.count()

    def write_CNT(self, value: int, _: int) -> int:  # noqa: N802
        """Set the count."""
        self._restart(value)
        return value

    def write_EGR(self, value: int, _: int) -> int:  # noqa: N802
        """Update by software."""
        if value & 1:
            self._prescaler = self.now["PSC"]
            if not self.flag("CR1", 2):
                self.raise_flag("SR", 0)
            self._restart(0)
        return 0

    def write_SR(self, value: int, before: int) -> int:  # noqa: N802
        """Flags are cleared by zeros."""
        return before & value

    def write_CR1(self, value: int, before: int) -> int:  # noqa: N802
        """Start and stop."""
        count = self.count()
        self.now["CR1"] = value
        if (value ^ before) & 1:
            self._restart(count)
        return value

    def capture(self, channel: int, value: int) -> None:
        """Take a value into a channel."""
        self.now[f"CCR{channel}"] = value & _UINT32_MAX
        if self.flag("SR", channel):
            self.raise_flag("SR", 8 + channel)
        self.raise_flag("SR", channel)
        if channel == 1 and self.field("CR2", 4, 3) == 3:
            self.system.trigger(self.name)

    def source(self, channel: int) -> int:
        """Return what a channel captures: 1 its own input, 3 the trigger; 0 nothing."""
        register, at = ("CCMR1", "CCMR2")[(channel - 1) // 2], 8 * ((channel - 1) % 2)
        name = {"CCMR1": "CCMR1_Output", "CCMR2": "CCMR2_Output"}[register]
        selected = self.field(name if name in self.now else register, at, 2)
        return selected if self.flag("CCER", 4 * (channel - 1)) else 0

    def triggered_by(self, other: str) -> None:
        """Capture on the trigger of another timer."""
        if TRGO_OF.get((self.name, self.field("SMCR", 4, 3))) == other:
            for channel in range(1, 5):
                if self.source(channel) == 3:
                    self.capture(channel, self.count())

    def read_CCR1(self) -> int:  # noqa: N802
        """Reading takes note."""
        self.drop_flag("SR", 1)
        return self.now["CCR1"]

    def read_CCR3(self) -> int:  # noqa: N802
        """Reading takes note."""
        self.drop_flag("SR", 3)
        return self.now["CCR3"]


class EncoderTimer(Timer):
    """TIM2, which counts edges when it is told to."""

    def reset(self) -> None:
        """Stand at 0."""
        super().reset()
        self._count = 0
        self._world: int | None = None

    def count(self) -> int:
        """Return the count of encoder edges."""
        return self._count & _UINT32_MAX if self.field("SMCR", 0, 3) else super().count()

    def turn(self, to: int) -> None:
        """Let the encoder come to this count of its own, edge by edge."""
        led = self.system.wires.leads("ENCODER_A") and self.system.wires.leads("ENCODER_B")
        inputs = self.source(1) == 1 and self.field("CCMR1_Output", 8, 2) == 1
        before, self._world = self._world, to
        if before is None or before == to:
            return
        if not (
            led and inputs and self.field("SMCR", 0, 3) == 3 and self.flag("CR1", 0) and self.is_clocked()
        ):
            return
        step = 1 if to > before else -1
        (self.raise_flag if step < 0 else self.drop_flag)("CR1", 4)
        for place in range(before, to, step):
            self._count += step
            rising = place % 4 == (0 if step > 0 else 3)  # A goes up here, in both directions
            if rising and self.flag("CCER", 0):
                self.capture(1, self._count)


class PwmTimer(Timer):
    """TIM1: channel 1, main output enable, break."""

    NAME = "TIM1"
    BREAK_IRQ = 24

    def __init__(self, system: System) -> None:
        super().__init__(system, "TIM1")

    def duty(self) -> float:
        """Return the part of the time that the output is high."""
        mode = self.field("CCMR1_Output", 4, 3)
        driven = self.flag("BDTR", 15) and self.flag("CCER", 0) and self.flag("CR1", 0) and mode == 6
        return min(self.now["CCR1"] / (self.now["ARR"] + 1), 1.0) if driven else 0.0

    def _broken(self) -> bool:
        wires = self.system.wires
        level = wires.leads("BREAK") and wires.outside("BREAK")
        return self.flag("BDTR", 12) and level == self.flag("BDTR", 13)

    def look_at_break(self) -> None:
        """Disable the outputs if the break input is active, by the polarity in BDTR."""
        if self._broken():
            self.drop_flag("BDTR", 15)
            self.raise_flag("SR", 7)
            self.system.cpu.line(self.BREAK_IRQ, lambda: bool(self.now["SR"] & self.now["DIER"] & 0x80))
            self.system.look_at_pins()

    def _kept(self, register: str, value: int, before: int, bits: int) -> int:
        """Return what a register holds, some bits of which are locked (RM0090, LOCK of TIM1_BDTR)."""
        if (value ^ before) & bits:
            self.misuse(f"{register}: locked bits in {value:#x}")
        return value & ~bits | before & bits

    def write_BDTR(self, value: int, before: int) -> int:  # noqa: N802
        """Enable outputs, unless the pin says no; what is locked stays, LOCK itself first of all."""
        lock = before >> 8 & 3
        bits = (0x73FF if lock else 0) | (0x0C00 if lock >= 2 else 0)
        self.now["BDTR"] = self._kept("BDTR", value, before, bits)
        self.look_at_break()
        self.system.look_at_pins()
        return self.now["BDTR"]

    def write_CR2(self, value: int, before: int) -> int:  # noqa: N802
        """Set the idle states, as long as nothing is locked."""
        return self._kept("CR2", value, before, 0x7F00 if self.field("BDTR", 8, 2) else 0)

    def write_CCER(self, value: int, before: int) -> int:  # noqa: N802
        """Set the polarities, as long as they are not locked."""
        return self._kept("CCER", value, before, 0x2AAA if self.field("BDTR", 8, 2) >= 2 else 0)

    def write_CCMR1_Output(self, value: int, before: int) -> int:  # noqa: N802
        """Set the modes of the channels, as long as they are not locked."""
        return self._kept("CCMR1", value, before, 0x7878 if self.field("BDTR", 8, 2) == 3 else 0)

    def write_CCR1(self, value: int, _: int) -> int:  # noqa: N802
        """Change the duty cycle."""
        self.now["CCR1"] = value
        self.system.look_at_pins()
        return value
