"""Every register that the firmware knows, as the vendor describes it; the interrupts' numbers too."""

from __future__ import annotations

import re

import pytest

from tests.target.build import FIRMWARE
from tests.target.machine.svd import peripherals
from tests.target.registers import NO_FIELD, REGS, check, check_constants, read_header

INTERRUPTS = {
    "BXCAN_TX_IRQ": "CAN1_TX",
    "BXCAN_RX0_IRQ": "CAN1_RX0",
    "BXCAN_SCE_IRQ": "CAN1_SCE",
    "LINK_IRQ": "EXTI0",
    "TIMEBASE_TICK_IRQ": "TIM3",
    "USART1_IRQ": "USART1",
    "USART2_IRQ": "USART2",
    "BOARD_TICK_IRQ": "TIM3",
}


def test_every_definition_is_the_vendors() -> None:
    wrong = check(REGS.read_text())
    assert not wrong, "\n".join(["regs.h, against the vendor's description:", *wrong])


def test_nothing_escapes() -> None:
    text = REGS.read_text()
    header = read_header(text)
    defined = set(re.findall(r"^\s*#\s*define (\w+)", text, re.MULTILINE)) - {"REGS_H", "BIT"}
    assert set(header.constants) | set(header.peripherals) == defined
    assert {struct for struct, _ in header.peripherals.values()} <= set(header.structs)
    assert len(header.constants) > 120


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("RCC_CR_HSEON BIT(16)", "RCC_CR_HSEON BIT(18)", "RCC_CR_HSEON: 0x40000 is not"),
        ("CAN_BTR_TS1_POS 16u", "CAN_BTR_TS1_POS 15u", "CAN_BTR_TS1_POS: 0xf is not"),
        ("RCC_PLLCFGR_PLLQ_POS 24u", "RCC_PLLCFGR_PLLQ_POS 25u", "RCC_PLLCFGR_PLLQ_POS: 0x19 is not"),
        ("TIM_BDTR_MOE BIT(15)", "TIM_BDTR_MOE BIT(14)", "TIM_BDTR_MOE: 0x4000 is not what TIM1"),
        ("TIM_SR_ALL 0x1E5Fu", "TIM_SR_ALL 0x1E7Fu", "TIM_SR_ALL: 0x1e7f is not"),
        ("TIM_CR2_MMS_CAPTURE 3u", "TIM_CR2_MMS_CAPTURE 8u", "TIM_CR2_MMS_CAPTURE: 0x8 is not"),
        ("RCC_CSR_RMVF", "RCC_CSR_RMFV", "RCC_CSR_RMFV: nothing like it"),
        ("RCC_CSR_RMVF", "RCC_CRS_RMVF", "RCC_CRS_RMVF: nothing like it"),
        ("RCC_CSR_RMVF", "RMVF", "RMVF: nothing like it"),
        (
            "TIM5 ((struct timer *)0x40000C00u)",
            "TIM5 ((struct timer *)0x40000800u)",
            "TIM5: CR1 is at 0x40000800",
        ),
        ("GPIOB ((", "GPIOX ((", "GPIOX: no such peripheral"),
        ("KEYR, OPTKEYR, SR", "OPTKEYR, KEYR, SR", "FLASH: OPTKEYR is KEYR"),
        ("reserved_28[2];", "reserved_28[3];", "RCC: AHB1ENR is at 0x40023834"),
        ("reserved_1D0[12]", "reserved_1D0[11]", "CAN1: FMR is at 0x400065fc"),
        ("IR, DTR, DLR, DHR;", "IR, DTR, DHR, DLR;", "CAN1: T[0].DHR is TDL0R"),
        ("R1, R2;\n", "R1, R2, R3;\n", "CAN1: F[0].R3 is F1R1"),
        ("uint32_t CR, CSR;", "uint32_t CR, CSR, CTR;", "struct pwr: no peripheral has a register CTR there"),
        ("uint32_t CR, CSR;", "uint32_t CR, reserved_4;", "PWR: reserved_4 is CSR"),
        ("reserved_1A0[24], IABR", "reserved_1A0[25], IABR", "NVIC: IABR[0] is"),
        ("reserved_220[56]", "reserved_220[55]", "NVIC: IPR[0] is at 0xe000e3fc"),
        ("VTOR, AIRCR, SCR", "AIRCR, VTOR, SCR", "SCB: AIRCR is VTOR"),
        ("CTRL, LOAD, VAL", "CTRL, VAL, LOAD", "SYSTICK: VAL is LOAD"),
        ("FLASH_KEY1", "FLASH_KEY3", "FLASH_KEY1: excepted, and not there"),
    ],
)
def test_seeded_errors_are_found(right: str, wrong: str, said: str) -> None:
    text = REGS.read_text()
    assert right in text
    found = check(text.replace(right, wrong, 1))
    assert any(line.startswith(said) for line in found), found


def test_no_constant_can_be_wrong_unnoticed() -> None:
    header = read_header(REGS.read_text())
    unnoticed = {
        name
        for name, value in header.constants.items()
        if not list(check_constants(header._replace(constants={name: value + 0x100})))
    }
    assert unnoticed == set(NO_FIELD)


def _interrupts() -> dict[str, int]:
    return {
        interrupt.findtext("name", ""): int(interrupt.findtext("value", ""))
        for peripheral in peripherals().values()
        for interrupt in peripheral.iter("interrupt")
    }


def test_interrupts_have_the_vendors_numbers() -> None:
    vendors = _interrupts()
    ours = {
        name: int(number)
        for header in sorted(FIRMWARE.glob("**/*.h"))
        for name, number in re.findall(r"^#define (\w+_IRQ) (\d+)u\b", header.read_text(), re.MULTILINE)
    }
    assert set(ours) == set(INTERRUPTS)
    assert ours == {name: vendors[INTERRUPTS[name]] for name in ours}


def test_no_address_of_a_register_is_elsewhere() -> None:
    sources = {path for folder in ("soc", "boards") for path in (FIRMWARE / folder).glob("**/*.[ch]")} - {
        REGS
    }
    assert len(sources) > 30
    assert [path.name for path in sources if re.search(r"\b0x(4|5|E)[0-9A-F]{7}u?\b", path.read_text())] == []
