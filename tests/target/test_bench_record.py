"""What a bench board keeps, and what it makes of it, on rung D."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Parameter, State
from tests.target.machine.memory import sector
from tests.target.machine.system import System
from tests.target.rung import CONFIG, never_on, said_of, state_of
from tools.record import RECORD_BYTES, RecordLink, image, record

if TYPE_CHECKING:
    from pathlib import Path

NO_MEMORY = 4  # detail of INTERNAL


def records(system: System) -> int:
    """Count the places of both sectors that are written."""
    return sum(
        any(byte != 0xFF for byte in data[at : at + RECORD_BYTES])
        for data in (sector(system.uc, 1), sector(system.uc, 2))
        for at in range(0, len(data), RECORD_BYTES)
    )


def test_boots_are_counted_across_resets(f405: Path) -> None:
    """A reset costs no record where one before it reserved its number; power leaves reserved ones out."""
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG, boot_count=41)))
    system.run_for(20_000.0)
    assert (said_of(system, Parameter.BOOT_COUNT), records(system)) == (42, 2)
    for cause, number, count, written in (
        ("pin", 2, 43, 3), ("software", 3, 44, 3), ("power", 1, 45, 4), ("pin", 2, 46, 5),
        ("watchdog", 4, 47, 5), ("brown-out", 5, 48, 6), ("pin", 2, 49, 6), ("power", 1, 52, 7),
    ):  # fmt: skip
        system.reset(cause)
        system.run_for(20_000.0)
        assert said_of(system, Parameter.RESET_CAUSE) == number
        assert (said_of(system, Parameter.BOOT_COUNT), records(system)) == (count, written)
    assert system.misuse == []


def test_restart_loop_costs_few_records(f405: Path) -> None:
    """A main loop that never comes to its turn: the watchdog resets the board over and over."""
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG)), lsi_hz=47_000.0)
    for boots in range(1, 35):
        system.run_for(8_000.0)
        system.starved = True
        system.run_for(20_000.0)
        system.starved = False
        assert [cause for _, cause in system.resets[1:]] == ["watchdog"] * boots
    system.run_for(20_000.0)
    assert said_of(system, Parameter.BOOT_COUNT) == len(system.resets) == 35
    assert records(system) == 1 + 6  # resets 0, 1, 3, 7, 15 and 31
    assert never_on(system, 0.0)
    assert system.misuse == []


def test_record_that_cannot_be_written_is_told(f405: Path) -> None:
    """A place that reads blank and takes no write: the number is not known, and the board is in FAULT."""
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG, boot_count=41)))
    system.flash.broken = True
    system.run_for(20_000.0)
    assert state_of(system) is State.FAULT
    assert said_of(system, Parameter.BOOT_COUNT) == 0
    system.reset("pin")
    system.run_for(20_000.0)
    assert said_of(system, Parameter.LAST_FAULT_DETAIL) == NO_MEMORY
    assert never_on(system, 0.0)
    system.flash.broken = False
    system.reset("pin")
    system.run_for(20_000.0)
    assert said_of(system, Parameter.BOOT_COUNT) == 42


def test_full_sector_is_left_for_the_other(f405: Path) -> None:
    full = b"".join(record(CONFIG, sequence=n, boot_count=n) for n in range(1, 205))
    system = System(f405 / "bench_f405_dac.elf", full.ljust(16_384, b"\xff") + b"\0" * 16_384)
    system.run_for(400_000.0)
    assert said_of(system, Parameter.BOOT_COUNT) == 205
    assert system.flash.erased == 1
    system.reset("pin")
    system.run_for(20_000.0)
    assert said_of(system, Parameter.BOOT_COUNT) == 206
    assert system.misuse == []


@pytest.mark.parametrize(
    ("kept", "detail"),
    [
        (b"", 2),
        (image(record(CONFIG | {"period_us": 20})), 16),
        (image(record(CONFIG | {"watchdog_ms": 60})), 16),
    ],
    ids=["blank", "a period that is too short", "a watchdog that is too long"],
)
def test_board_without_a_good_record_is_weak_and_in_fault(f405: Path, kept: bytes, detail: int) -> None:
    system = System(f405 / "bench_f405_dac.elf", kept)
    system.run_for(20_000.0)
    assert state_of(system) is State.FAULT
    assert said_of(system, Parameter.VOLTAGE_LIMIT_MV) == 1000
    assert said_of(system, Parameter.PERIOD_US) == 1000
    assert never_on(system, 0.0)
    assert system.flash.written == 0
    system.reset("pin")
    system.run_for(20_000.0)
    assert said_of(system, Parameter.LAST_FAULT) == Fault.INTERNAL
    assert said_of(system, Parameter.LAST_FAULT_DETAIL) == detail


@pytest.mark.parametrize("rate", [500_000, 2_000_000])
def test_line_runs_at_the_rate_of_the_record(f405: Path, rate: int) -> None:
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG, link=RecordLink.cobs, baud=rate)))
    system.usart.baud = rate
    system.run_for(20_000.0)
    assert said_of(system, Parameter.COUNTS_PER_REV) == 4096
    assert system.misuse == []


def test_edges_are_stamped_with_their_time(f405: Path) -> None:
    """The newest rising edge of A, by TIM5, for any delay of the interrupt."""
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG)))
    system.run_until(20_000.0)
    system.encoder.turn(0)
    before = system.timers["TIM5"].now["CCR1"]
    at = system.timers["TIM5"].count()
    system.encoder.turn(8)
    assert system.timers["TIM5"].now["CCR1"] == at != before
    assert system.encoder.now["CCR1"] & 3 == system.encoder.count() & 3 or system.encoder.now["CCR1"] > 0
