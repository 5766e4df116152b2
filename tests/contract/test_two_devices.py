"""Two devices with one number on the bus are told as that."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import OpenError
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import (
    State,
)
from tests.contract.benches import on_bench
from tests.contract.driving import drive
from tests.contract.lies import SHORT_BOOT_WAIT

if TYPE_CHECKING:
    from dcmp_hil.wire.frame import Frame


pytestmark = pytest.mark.usefixtures("needs_compiler")


@pytest.mark.parametrize("first_tick", [0, 100, 1000])
def test_second_device_that_is_plugged_in_during_a_run_is_told_as_that(first_tick: int) -> None:
    with (
        on_bench("sim-board can") as bench,
        on_bench("sim-board can", first_tick=first_tick) as other,
        bench.device() as backend,
    ):
        drive(backend, 1.0, 50)
        send = bench.board.transmit_frames

        def both() -> list[Frame]:
            other.board.tick()
            return send() + other.board.transmit_frames()

        bench.board.transmit_frames = both  # type: ignore[method-assign]
        faults = [sample.fault for sample in drive(backend, 1.0, 3)]
        assert faults[-1] == Fault.TWO_DEVICES


def test_device_that_is_reset_is_not_two() -> None:
    with on_bench("sim-board can") as bench, bench.device() as backend:
        drive(backend, 1.0, 50)
        bench.board.reset()
        assert drive(backend, 1.0, 3)[-1].fault == Fault.DISARMED


def test_two_devices_with_one_node_are_told_as_that() -> None:
    with (
        on_bench("sim-board can", SHORT_BOOT_WAIT) as bench,
        on_bench("sim-board can", first_tick=100) as other,
    ):
        send = bench.board.transmit_frames

        def both() -> list[Frame]:
            frames = send()
            if frames:
                other.board.tick()
                frames += other.board.transmit_frames()
            return frames

        bench.board.transmit_frames = both  # type: ignore[method-assign]
        with pytest.raises(OpenError, match="two devices send as node 0"):
            bench.make().__enter__()
        assert bench.board.state == State.IDLE
