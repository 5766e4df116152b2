"""A13: the bench board's own program is attacked on the machine that is modelled register by register.

What attacks: a program that has run away and writes to the break of the power stage; code that keeps the tick
from being served. What is promised: what was locked stays until a reset, and a tick that was missed shows in
HEALTH. That no limit can be raised over the wire is in tests/firmware/core/test_parameters.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.wire import cobs
from dcmp_hil.wire.codec import unpack
from dcmp_hil.wire.messages import Health
from tests.target.conftest import f405  # noqa: F401
from tests.target.machine.system import System
from tests.target.rung import CONFIG, TICK_IRQ
from tools.record import image, record

if TYPE_CHECKING:
    from pathlib import Path

_LOCKED = {"BDTR": 0x7FFF, "CR2": 0x0300, "CCER": 0x0002, "CCMR1_Output": 0x0070}
"""Registers of TIM1, and bits of them that must not change: break, lock, idle state, polarity, mode."""


def late_ticks(system: System) -> int:
    """Return `late_ticks` of the newest HEALTH."""
    system.usart.sent.clear()
    system.run_for(120_000.0)
    said = [unpack(frame, 0) for frame in cobs.CobsDecoder().feed(b"\0" + bytes(system.usart.sent))]
    return [message.late_ticks for message in said if isinstance(message, Health)][-1]


@pytest.mark.parametrize("register", _LOCKED)
def test_power_stage_is_locked_after_set_up(f405: Path, register: str) -> None:  # noqa: F811
    system = System(f405 / "bench_f405_pwm.elf", image(record(CONFIG)))
    system.run_for(20_000.0)
    assert system.misuse == []  # it was set up in an order that its lock allows
    before = system.pwm.now[register]
    system.pwm.store(system.pwm.offsets[register], 4, before ^ _LOCKED[register])
    assert system.pwm.now[register] == before
    assert len(system.misuse) == 1
    assert "locked" in system.misuse[0]


@pytest.mark.parametrize("blocked_us", [4_500.0, 9_500.0])
def test_missed_tick_is_counted(f405: Path, blocked_us: float) -> None:  # noqa: F811
    system = System(f405 / "bench_f405_dac.elf", image(record(CONFIG)))
    system.run_for(20_000.0)
    before = late_ticks(system)
    system.cpu.masked |= {TICK_IRQ}
    system.run_for(blocked_us)
    system.cpu.masked.clear()
    counted = late_ticks(system) - before
    assert int(blocked_us / 1000.0) - 1 <= counted <= int(blocked_us / 1000.0) + 1
    assert system.misuse == []
