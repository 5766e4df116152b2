"""The machine can fail: what no program may do is noticed, and a clock that is wrong is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.target.machine.system import System

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

RCC, FLASH, IWDG, GPIOA, GPIOB, TIM3, USART1, CAN1, DAC = (
    0x4002_3800, 0x4002_3C00, 0x4000_3000, 0x4002_0000, 0x4002_0400, 0x4000_0400, 0x4001_1000, 0x4000_6400,
    0x4000_7400,
)  # fmt: skip


class Bare:
    """A machine without a program: the test is the program."""

    def __init__(self, f405: Path) -> None:
        self.system = System(f405 / "bench_f405_dac.elf")

    def write(self, address: int, value: int, size: int = 4) -> None:
        self.system.bus.store(self.system.uc, address - 0x4000_0000, size, value, None)

    def do(self, *writes: tuple[int, int]) -> None:
        for address, value in writes:
            self.write(address, value)

    def read(self, address: int) -> int:
        return self.system.bus.load(self.system.uc, address - 0x4000_0000, 4, None)


@pytest.fixture
def bare(f405: Path) -> Bare:
    return Bare(f405)


MISUSES: dict[str, tuple[Callable[[Bare], object], str]] = {
    "no clock": (lambda m: m.write(GPIOA, 0xA800_0001), "MODER is written without a clock"),
    "no clock, read": (lambda m: m.read(CAN1), "MCR is read without a clock"),
    "reserved bits": (lambda m: m.write(RCC + 0x30, 0x0010_0800), "reserved bits"),
    "nothing there": (lambda m: m.write(IWDG + 0x40, 1), "nothing at offset 0x40"),
    "no peripheral": (lambda m: m.write(0x4001_F000, 1), "nothing is at 0x4001f000"),
    "a byte": (lambda m: m.write(RCC + 0x30, 1, 1), "in 1 bytes"),
    "watchdog locked": (lambda m: m.write(IWDG + 4, 1), "locked or busy"),
    "watchdog's key": (lambda m: m.write(IWDG, 0x1234), "key 0x1234"),
    "flash's key": (lambda m: m.write(FLASH + 4, 1), "a wrong key"),
    "flash locked": (lambda m: m.write(FLASH + 0x10, 0x200), "CR is written while it is locked"),
    "clock not ready": (lambda m: m.write(RCC + 8, 2), "SYSCLK goes to source 2"),
    "PLL without crystal": (lambda m: m.do((RCC, 0x0100_0083), (RCC + 4, 0x2440_3010)), "PLLCFGR changes"),
    "CAN outside its initialisation": (
        lambda m: m.do((RCC + 0x40, 1 << 25), (CAN1 + 0x1C, 0x0123_0000)), "outside initialisation",
    ),
    "DAC without its pin": (
        lambda m: m.do((RCC + 0x40, 1 << 29), (RCC + 0x30, 0x0010_0001), (DAC, 1)),
        "its pin is not analog",
    ),
    "a baud rate": (
        lambda m: m.do((RCC + 0x44, 1 << 4), (USART1 + 8, 17), (USART1 + 0xC, 1 << 13)), "baud",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MISUSES)
def test_misuse_is_noticed(bare: Bare, name: str) -> None:
    deed, said = MISUSES[name]
    deed(bare)
    assert any(said in line for line in bare.system.misuse), bare.system.misuse


def test_reset_values_are_the_manuals(bare: Bare) -> None:
    system = bare.system
    assert system.rcc.now["CR"] & 0xFF == 0x83
    assert (system.can.now["MCR"], system.can.now["MSR"], system.can.now["TSR"]) == (
        0x1_0002,
        0xC02,
        0x1C00_0000,
    )
    assert system.iwdg.now["RLR"] == 0xFFF
    assert system.gpio["A"].now["MODER"] == 0xA800_0000
    assert system.rcc.core_Hz() == 16e6


def test_stage_reads_full_negative_until_it_is_set_up(bare: Bare) -> None:
    assert bare.system.stage.input_mV == -10_000.0
    assert bare.system.amplifier_mV == 0.0  # ENABLE gates it


def test_timer_runs_at_the_clock_that_it_is_given(bare: Bare) -> None:
    bare.write(RCC + 0x40, 2)  # TIM3
    for offset, value in ((0x28, 31), (0x2C, 499), (0x00, 4), (0x14, 1), (0x00, 5)):
        bare.write(TIM3 + offset, value)
    system = bare.system
    system.starved = True  # no program
    system.run_until(100.0)
    assert bare.read(TIM3 + 0x24) == 50  # 16 MHz / 32
    system.run_until(1010.0)
    assert bare.read(TIM3 + 0x10) & 1
    assert bare.read(TIM3 + 0x24) == 5


@pytest.mark.parametrize("lsi_hz", [17_000.0, 32_000.0, 47_000.0])
def test_watchdog_bites_by_its_own_oscillator(f405: Path, lsi_hz: float) -> None:
    bare = Bare(f405)
    bare.system.lsi_hz = lsi_hz
    bare.write(IWDG, 0xCCCC)
    bare.system.starved = True
    bare.system.run_until(4.0 * 4096 / lsi_hz * 1e6 + 1.0)
    assert [cause for _, cause in bare.system.resets] == ["power", "watchdog"]
    assert bare.system.resets[1][0] == pytest.approx(4.0 * 4096 / lsi_hz * 1e6, abs=1.0)
    assert {26, 27, 29} <= {bit for bit in range(32) if bare.system.rcc.now["CSR"] >> bit & 1}


def test_encoder_counts_only_where_its_pins_lead(bare: Bare) -> None:
    system = bare.system
    bare.write(RCC + 0x40, 1)
    bare.write(RCC + 0x30, 0x0010_0001)
    tim2 = 0x4000_0000
    for offset, value in ((0x18, 0x101), (0x08, 3), (0x20, 1), (0x00, 1)):
        bare.write(tim2 + offset, value)
    system.encoder.turn(0)
    system.encoder.turn(40)
    assert bare.read(tim2 + 0x24) == 0
    bare.write(GPIOA, 0xA800_000A)
    bare.write(GPIOA + 0x20, 0x11)
    system.encoder.turn(100)
    assert bare.read(tim2 + 0x24) == 60
    system.encoder.turn(97)
    assert bare.read(tim2 + 0x24) == 57
    assert bare.read(tim2) >> 4 & 1  # downwards
