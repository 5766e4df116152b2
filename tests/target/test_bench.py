"""Rung D: the bench board's own program, unmodified, on the machine; its host is the real backend."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.factory import open_backend
from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.wire.messages import Parameter
from sim_backend.board.backend import SimBoardBackend
from sim_backend.board.board import Board
from tests.contract.benches import PatientClock, pumped
from tests.helpers import bench
from tests.target.machine.board import TargetBoard
from tests.target.machine.system import STACK_TOP_OF_BOARD, System
from tests.target.rung import (
    BOARDS,
    CARRIERS,
    COUNT_RAD,
    CYCLES_A_MS,
    PWM,
    RELEASED,
    STILL,
    TICK_IRQ,
    rung,
    said_of,
    sine,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.backend import Backend
    from dcmp_hil.config import Rig
    from dcmp_hil.values import Sample


# ------------------------------------------------------------------------------------------- closed loop


def closed_loop(backend: Backend, periods: int = 300) -> list[Sample]:
    """Return the samples of a motor on a sine."""
    seen = []
    with backend:
        for k in range(periods):
            seen.append(backend.read())
            backend.write(sine(k, seen[-1]))
    return seen


def of_the_core(carrier: str) -> list[Sample]:
    """Return the samples of the core alone."""
    rig = bench("backend.kind=sim-board", f"backend.carrier={carrier}", *STILL)
    return closed_loop(SimBoardBackend(rig, SimulatedClock(), Board(rig, carrier=carrier)))


def furthest_counts(seen: list[Sample], core: list[Sample]) -> float:
    """Return how far two runs are from each other, at their worst."""
    return max(abs(a.position - b.position) for a, b in zip(seen, core, strict=True)) / COUNT_RAD


@pytest.mark.parametrize("carrier", CARRIERS)
def test_closed_loop_is_that_of_the_core(f405: Path, carrier: str, figure: Callable[[str], None]) -> None:
    core = of_the_core(carrier)
    with rung(f405, carrier) as target:
        seen = target.drive(300, sine)
        target.host.__exit__(None, None, None)
        assert not target.system.enable
    assert [sample.t for sample in seen] == [sample.t for sample in core]
    assert furthest_counts(seen, core) <= 2.0  # the DAC's steps of 5 mV are all that is different
    assert max(abs(sample.voltage) for sample in seen) > 2.0
    stack = STACK_TOP_OF_BOARD - target.system.lowest_stack
    figure(
        f"rung D over {carrier}: stack {stack} B deep, {furthest_counts(seen, core):.0f} counts from the core"
    )
    assert stack < 2048


@pytest.mark.parametrize("way", ["can virtual", "slcan pty", "cobs pty"])
def test_closed_loop_through_python_can_and_pyserial(f405: Path, way: str) -> None:
    """The same, where each frame crosses a bus of python-can, or each byte a port of the system."""
    carrier = way.split(maxsplit=1)[0]

    boards = []

    def make(rig: Rig, carrier: str) -> TargetBoard:
        boards.append(TargetBoard(f405 / "bench_f405_dac.elf", rig, carrier))
        return boards[-1]

    with pumped(way, STILL, make) as bus:
        seen = closed_loop(open_backend(bus.rig, PatientClock()))
        system = boards[-1].system
    assert furthest_counts(seen, of_the_core(carrier)) <= 2.0
    assert max(abs(sample.voltage) for sample in seen) > 2.0
    assert not system.enable
    assert system.misuse == []


@pytest.mark.sampled
@pytest.mark.parametrize("seed", range(3))
def test_interrupts_anywhere_change_nothing(f405: Path, seed: int) -> None:
    with rung(f405, "cobs", preempt=seed) as target:
        seen = target.drive(100, sine)
    with rung(f405, "cobs") as calm:
        expected = calm.drive(100, sine)
    assert [(s.t, s.position, s.voltage) for s in seen] == [(s.t, s.position, s.voltage) for s in expected]
    assert target.system.faults == []


@pytest.mark.parametrize("carrier", CARRIERS)
def test_tick_costs_a_tenth_of_a_millisecond_at_most(
    f405: Path, carrier: str, figure: Callable[[str], None]
) -> None:
    with rung(f405, carrier, exact=True) as target:
        target.drive(5, sine)
        target.system.cpu.counts.clear()
        ticks, before = target.board.ticks, target.system.instructions
        target.drive(20, sine)
        ticks = target.board.ticks - ticks
        handlers = sum(sum(counts) for counts in target.system.cpu.counts.values()) / ticks
        longest = max(target.system.cpu.counts[16 + TICK_IRQ])
        everything = (target.system.instructions - before) / ticks
    figure(
        f"rung D over {carrier}: {handlers:.0f} instructions a period in interrupts "
        f"({longest} in the longest tick), {everything:.0f} in all, of {CYCLES_A_MS} cycles"
    )
    assert everything < 0.1 * CYCLES_A_MS


# ------------------------------------------------------------------------------------------- the way there


@pytest.mark.parametrize("board", RELEASED)
@pytest.mark.parametrize("carrier", CARRIERS)
def test_nothing_reaches_the_motor_before_it_is_armed(f405: Path, board: str, carrier: str) -> None:
    with rung(f405, carrier, board=BOARDS[board]) as target:
        armed = next(t for t, on, _ in target.system.pins_seen if on)
        assert all(mV == 0.0 for t, on, mV in target.system.pins_seen if t < armed)
        assert armed > 10_000.0  # the tenth DRIVE
        target.drive(3)
        assert target.system.amplifier_mV == pytest.approx(1000.0, abs=5.0)


def test_limits_are_true_at_a_supply_of_24_V(f405: Path) -> None:
    with rung(f405, board=PWM, supply_V=24.0) as target:
        for volts in (-2.5, 10.0, 50.0):
            target.drive(3, lambda *_, volts=volts: volts)
            limited = 1e3 * min(10.0, volts)
            assert target.system.amplifier_mV == pytest.approx(limited, abs=10.0)


def test_board_that_takes_another_supply_for_the_motors_is_not_armed(f405: Path) -> None:
    rig = bench("backend.kind=sim-board", "amplifier.supply_V=24.0")
    board = TargetBoard(f405 / "bench_f405_pwm.elf", rig)
    for other, says in (("10.0", "says 10, .* 24 V"), ("none", 'says "none", .* 24 V')):
        wrong = bench("backend.kind=sim-board", f"amplifier.supply_V={other}")
        with pytest.raises(ConfigError, match=rf"amplifier\.supply_V: the rig {says}"):
            SimBoardBackend(wrong, SimulatedClock(), board).__enter__()  # type: ignore[arg-type]
    assert not any(on for _, on, _ in board.system.pins_seen)


def test_board_without_a_record_never_puts_out_more_than_is_asked_for(f405: Path) -> None:
    system = System(f405 / "bench_f405_pwm.elf", b"", supply_mV=100_000.0)
    system.run_for(20_000.0)
    assert said_of(system, Parameter.SUPPLY_MV) == 100_000


def test_bridge_turns_either_way(f405: Path) -> None:
    with rung(f405, board=PWM) as target:
        target.drive(3, lambda *_: -2.5)
        assert target.system.amplifier_mV == pytest.approx(-2500.0, abs=2.0)
        target.drive(3, lambda *_: 10.0)
        assert target.system.amplifier_mV == pytest.approx(10_000.0, abs=2.0)
