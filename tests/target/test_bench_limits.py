"""Limits of a run on rung D: the handshake sets them in the bench board's own program, which keeps them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Parameter
from sim_backend.board.backend import SimBoardBackend
from tests.helpers import bench
from tests.target.machine.board import TargetBoard
from tests.target.rung import COUNT_RAD, STILL, said_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.values import Truth

_PUSHED_PERIODS = 400  # periods at most


def _pushed(f405: Path, volts: float, *overrides: str) -> tuple[TargetBoard, int, float, float]:
    """Push an arm until the device ends it; return the fault, and the arm's speed and position then."""
    rig = bench("backend.kind=sim-board", "supervisor.monitors=finite", *STILL, *overrides)
    board = TargetBoard(f405 / "bench_f405_dac.elf", rig)
    host = SimBoardBackend(rig, SimulatedClock(), board)  # type: ignore[arg-type]
    host.__enter__()
    seen: list[tuple[bool, Truth]] = []
    tick = board.tick

    def watched_tick() -> None:
        tick()
        seen.append((board.enable, board.truth()))

    board.tick = watched_tick  # type: ignore[method-assign]
    for _ in range(_PUSHED_PERIODS):
        sample = host.read()
        if sample.fault:
            break
        host.write(volts)
    else:
        raise AssertionError("nothing ended it")
    assert board.system.misuse == []
    off = next(truth for on, truth in seen if not on)
    return board, sample.fault, off.velocity, off.position


@pytest.mark.parametrize("volts", [10.0, -10.0, 3.0])
def test_speed_limit_of_a_session_is_kept(f405: Path, volts: float, figure: Callable[[str], None]) -> None:
    board, fault, speed, _ = _pushed(f405, volts, "supervisor.velocity_limit_rad_s=2.0")
    figure(f"rung D: a limit of 2 rad/s, pushed by {volts:+.0f} V: {speed:+.2f} rad/s at 0 V")
    assert fault == Fault.OVER_SPEED
    assert 2.0 < abs(speed) <= 3.0
    board.system.run_for(600_000.0)  # the session is forgotten
    assert said_of(board.system, Parameter.SPEED_LIMIT_COUNTS_S) == 8 * 4096


@pytest.mark.parametrize("start", [0.4, -0.4])
def test_travel_limit_of_a_session_is_kept_about_hanging(f405: Path, start: float) -> None:
    """The chip's counter is 0 where the arm was at boot; hanging is a count of the rig."""
    zero = -round(start / COUNT_RAD)
    limits = ("supervisor.position_limit_rad=0.8", f"sim.position_rad={start}", f"encoder.zero={zero}")
    board, fault, _, position = _pushed(f405, 10.0, *limits)
    assert fault == Fault.OVER_TRAVEL
    assert 0.8 < position < 0.86
    board.system.run_for(600_000.0)
    assert said_of(board.system, Parameter.TRAVEL_ORIGIN_COUNTS) == -1
