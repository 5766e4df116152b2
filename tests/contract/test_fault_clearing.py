"""A latched fault is cleared though commands are lost, and given up in time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import OpenError
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import (
    Drive,
    FaultReport,
    SampleReport,
    State,
    Stop,
    StopReason,
)
from tests.contract.benches import on_bench
from tests.contract.driving import drive
from tests.contract.hooks import on_way_down
from tests.contract.lies import lying

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.messages import Message
    from tests.contract.benches import Bench


pytestmark = pytest.mark.usefixtures("needs_compiler")


def commands(bench: Bench, lose: Callable[[Drive, int], bool] = lambda *_: False) -> list[Drive]:
    """Watch the DRIVEs on their way to the board; `lose` some, by what they say and how many came before."""
    heard: list[Drive] = []
    receive = bench.board.receive_frame

    def watch(number: int, data: bytes) -> None:
        message = unpack((number, data))
        if isinstance(message, Drive):
            heard.append(message)
            if lose(message, len(heard) - 1):
                return
        receive(number, data)

    bench.board.receive_frame = watch  # type: ignore[method-assign]
    return heard


def stopped(bench: Bench) -> None:
    """Leave the board in FAULT."""
    bench.board.tick()
    bench.board.receive_frame(*pack(Stop(StopReason.SUPERVISOR)))
    assert bench.board.state == State.FAULT


@pytest.mark.parametrize("lost", [{0}, {1}, {0, 1}, {1, 3, 5}, {0, 2, 3, 4, 7}, set(range(20))])
def test_a_fault_is_cleared_though_commands_are_lost(lost: set[int]) -> None:
    with on_bench("sim-board can") as bench:
        stopped(bench)
        heard = commands(bench, lambda _, count: count in lost)
        with bench.device() as backend:
            assert "STOPPED" in backend.described
            drive(backend, 1.0, 3)
    clears = [drive.clear for drive in heard[: 1 + max(lost)]]
    assert clears == [bool(k % 2) for k in range(len(clears))]


def test_a_fault_that_stays_is_given_up_after_half_a_second() -> None:
    with on_bench("sim-board can") as bench:
        stopped(bench)
        heard = commands(bench, lambda said, _: said.clear)
        before = bench.board.tick_count
        with pytest.raises(OpenError, match="stays in fault STOPPED"):
            bench.make().__enter__()
        assert 400 <= len([said for said in heard if not said.release]) <= 502
        assert bench.board.tick_count - before < 1000
        assert bench.board.state == State.FAULT


@pytest.mark.parametrize("code", [2, 8, 9, 77])
def test_another_fault_in_its_place_is_not_cleared(code: int) -> None:
    with on_bench("sim-board can") as bench:
        stopped(bench)
        heard = commands(bench, lambda said, _: said.clear)

        def lie(message: Message) -> Message:
            if len(heard) >= 4 and isinstance(message, FaultReport):
                return message._replace(code=code)
            if len(heard) >= 4 and isinstance(message, SampleReport) and message.state == State.FAULT:
                return message._replace(fault_class=min(code, 7))
            return message

        on_way_down(bench, lying(lie))
        with pytest.raises(OpenError, match="fell into"):
            bench.make().__enter__()
        assert len([said for said in heard if not said.release]) <= 5
        assert bench.board.state == State.FAULT
