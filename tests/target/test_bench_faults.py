"""What may happen to a bench board on rung D: the motor has no voltage in time, and stays so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Parameter, State
from tests.helpers import bench
from tests.target.machine.board import TargetBoard
from tests.target.rung import (
    CARRIERS,
    FAST_US,
    IWDG_US,
    LINK_IRQ,
    PWM,
    STILL,
    TICK_IRQ,
    TICK_US,
    WATCHDOG_US,
    never_on,
    rung,
    said_of,
    state_of,
)

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("carrier", CARRIERS)
def test_silence_is_0_V_after_the_watchdog_and_a_tick(f405: Path, carrier: str) -> None:
    with rung(f405, carrier) as target:
        target.drive(20)
        last = target.system.now_us  # the DRIVE goes out now, and takes a moment on the wire
        off = target.run_until_off(2 * WATCHDOG_US)
    assert WATCHDOG_US < off - last <= WATCHDOG_US + TICK_US + 500.0


@pytest.mark.sampled
@pytest.mark.parametrize("lsi_hz", [17_000.0, 32_000.0, 47_000.0])
@pytest.mark.parametrize("stuck", ["tick", "link", "main"])
def test_stuck_task_is_reset_by_the_chips_own_watchdog(f405: Path, stuck: str, lsi_hz: float) -> None:
    """T08 and IWDG: if any task stops, the motor is off within 50 ms, the board comes back disarmed."""
    with rung(f405, lsi_hz=lsi_hz) as target:
        target.drive(20)
        began = target.system.now_us
        target.system.cpu.masked |= {"tick": {TICK_IRQ}, "link": {LINK_IRQ}, "main": set()}[stuck]
        target.system.starved = stuck == "main"
        off = target.run_until_off(2 * IWDG_US)
        assert off - began <= IWDG_US
        target.system.run_until(began + 2 * IWDG_US)
        resets = [(t, cause) for t, cause in target.system.resets if t > began]
        assert resets[0][1] == "watchdog"
        assert resets[0][0] - began <= IWDG_US
        target.system.cpu.masked.clear()
        target.system.starved = False
        target.system.run_for(40_000.0)
        assert never_on(target.system, off)
        assert said_of(target.system, Parameter.RESET_CAUSE) == 4
        assert state_of(target.system) is State.IDLE


def test_bus_off_is_0_V_within_2_ms_and_comes_back_disarmed(f405: Path) -> None:
    """W13 on CAN."""
    with rung(f405, "can") as target:
        target.drive(20)
        began = target.system.now_us
        target.system.can.go_bus_off(5_000.0)
        off = target.run_until_off(WATCHDOG_US)
        assert off - began <= FAST_US
        target.board.transmit_frames()
        target.system.run_for(120_000.0)
        frames = target.board.transmit_frames()
        assert never_on(target.system, off)
    faults = [data for number, data in frames if number == 0x030]
    assert {data[0] for data in faults} == {Fault.LINK_DOWN}
    assert any(number == 0x040 and data[6] & 7 == State.FAULT for number, data in frames)


def test_frames_without_an_acknowledge_are_given_up(f405: Path) -> None:
    with rung(f405, "can") as target:
        target.system.can.on_sent = lambda _: False
        target.system.run_for(30_000.0)
        heard: list[bytes] = []

        def hear(frame: tuple[int, bytes]) -> bool:
            heard.append(frame[1])
            return True

        target.system.can.on_sent = hear
        target.system.run_for(1_500.0)
        newest = target.board.ticks - 1
        samples = [data for data in heard if len(data) == 8]
        assert (newest - samples[0][5]) % 256 <= 2, "what was said first was old"


@pytest.mark.parametrize(("what", "speed"), [("speed", 60_000.0), ("travel", 30_000.0)])  # counts/s
def test_shove_is_stopped_within_2_ms_of_the_limit(f405: Path, what: str, speed: float) -> None:
    """P04: the arm is turned from outside, too fast or too far for what the board was built with."""
    wide = ("supervisor.velocity_limit_rad_s=50", "supervisor.position_limit_rad=25.132")
    with rung(f405, overrides=wide) as target:
        target.drive(20, lambda *_: 0.5)
        began, start = target.system.now_us, target.board.pins.count()
        target.board.turned = lambda now: start + int(1e-6 * speed * max(now - began, 0.0))
        limit_us = 0.0 if what == "speed" else 1e6 * 16_384 / speed
        seen = target.drive(20 + int(1e-3 * limit_us), lambda *_: 0.5)
        off = next(t for t, on, _ in target.system.pins_seen if t > began and not on)
        assert off - began - limit_us <= 2 * FAST_US  # a median of three ticks, and where in a tick it began
        assert off - began > limit_us
    assert seen[-1].fault == Fault[f"OVER_{what.upper()}"]


def test_break_input_cuts_the_bridge_without_software(f405: Path) -> None:
    with rung(f405, board=PWM) as target:
        target.drive(20)
        assert target.system.amplifier_mV > 900.0
        target.system.wires.drive("BREAK", high=False)
        target.system.pwm.look_at_break()
        assert target.system.amplifier_mV == 0.0  # before a single instruction
        assert target.drive(5)[-1].fault == Fault.BREAK_INPUT
        assert not target.system.enable
        target.system.wires.drive("BREAK", high=True)
        assert target.drive(5)[-1].fault == Fault.BREAK_INPUT  # until a host clears it
        assert not target.system.enable


def test_board_without_a_crystal_says_so_and_does_not_arm(f405: Path) -> None:
    rig = bench("backend.kind=sim-board", *STILL)
    board = TargetBoard(f405 / "bench_f405_dac.elf", rig, crystal=False)
    board.system.run_for(60_000.0)
    assert state_of(board.system) is State.FAULT
    assert never_on(board.system, 0.0)
    assert board.system.rcc.core_Hz() == 168e6
    assert board.system.misuse == []


def test_crystal_that_stops_in_a_run_resets_with_the_motor_off(f405: Path) -> None:
    with rung(f405) as target:
        target.drive(20)
        began = target.system.now_us
        target.system.rcc.stop_crystal()
        off = target.run_until_off(IWDG_US)
        assert off - began <= FAST_US
        target.system.run_for(80_000.0)
        assert never_on(target.system, off)
        assert said_of(target.system, Parameter.LAST_FAULT) == Fault.INTERNAL
        assert said_of(target.system, Parameter.LAST_FAULT_DETAIL) == 32


def test_crash_puts_enable_low_and_is_remembered(f405: Path) -> None:
    with rung(f405) as target:
        target.drive(20)
        began = target.system.now_us
        target.system.jump(0x3000_0000)
        off = target.run_until_off(FAST_US)
        assert off - began <= 1_000.0
        target.system.run_for(40_000.0)
        assert [cause for t, cause in target.system.resets if t > began] == ["software"]
        assert never_on(target.system, off)
        assert said_of(target.system, Parameter.RESET_CAUSE) == 3
        assert said_of(target.system, Parameter.LAST_FAULT_DETAIL) == 64
