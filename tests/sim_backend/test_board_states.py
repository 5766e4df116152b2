"""The board in this process: its counters, its configuration, silence, hang-up, reset and STOP."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.values import Fault
from dcmp_hil.wire import cobs
from dcmp_hil.wire.codec import unpack
from dcmp_hil.wire.messages import (
    FaultReport,
    Health,
    Parameter,
    State,
    Stop,
)
from dcmp_hil.wire.wrapping import unwrap
from sim_backend.board.board import Board
from sim_backend.board.config import board_config
from tests.helpers import bench
from tests.sim_backend.board_host import SESSION, Host

pytestmark = pytest.mark.usefixtures("needs_compiler")


@pytest.mark.parametrize(
    "of_board",
    [
        {"count_offset": 2**23 - 3},
        {"count_offset": 2**24 - 3},
        {"count_offset": -3},
        {"start_us": 2**32 - 20_000},
        {"first_tick": 2**32 - 30},
    ],
    ids=str,
)
def test_counters_that_wrap_change_nothing(of_board: dict[str, int]) -> None:
    host = Host(**of_board)
    offset = of_board.get("count_offset", 0)
    host.arm()
    for _ in range(60):
        host.drive(3000)
        host.tick()
    host.drive(3000)
    sample = host.tick()
    assert host.board.state == State.RUN
    turned = unwrap(0, sample.position_counts - offset, 24)
    assert turned == round(host.board.truth().position * 4096 / math.tau)
    assert turned > 10


def test_configuration_is_what_the_parameters_say() -> None:
    host = Host(
        *("amplifier.slew_V_s=700.0", "amplifier.supply_V=24.0"),
        *("loop.rate_hz=500.0", "encoder.counts_per_rev=2000.0"),
    )
    config = board_config(host.rig, 1)
    host.tick()
    got = {
        key: host.parameter(Parameter[key.upper()]) for key in config if key.upper() in Parameter.__members__
    }
    assert got == {key: config[key] for key in got}
    assert got["counts_per_rev"] == 2000
    assert got["period_us"] == 2000
    assert got["slew_mV_per_ms"] == 700
    assert got["supply_mV"] == 24_000
    assert len(got) == 14


def test_number_on_the_bus_is_that_of_the_rig() -> None:
    board = Board(bench("backend.kind=sim-board", "backend.node=5"), carrier="can")
    board.tick()
    assert [number & 0xF for number, _ in board.transmit_frames()] == [5]


def test_silent_host_is_noticed_within_a_period_too() -> None:
    host = Host()
    host.arm()
    host.drive(2000)
    host.tick()
    assert host.board.applied_mV == 2000
    host.board.advance(19_001)  # the last DRIVE came one period before
    assert (host.board.applied_mV, host.board.enable) == (0, False)
    assert (host.board.state, host.board.fault) == (State.FAULT, Fault.HOST_SILENT)


def test_line_that_is_unplugged_takes_the_voltage_away_at_once() -> None:
    host = Host()
    host.arm()
    host.drive(2000)
    host.tick()
    host.board.link(up=False)
    assert (host.board.applied_mV, host.board.enable) == (0, False)
    host.board.tick()
    assert host.board.transmit_frames() == []
    host.board.link(up=True)
    for _ in range(100):
        host.board.tick()
    assert {fault.code for fault in host.listen(FaultReport)} == {Fault.LINK_DOWN}


def test_reset_boots_disarmed_and_leaves_the_arm_where_it_was() -> None:
    host = Host()
    host.arm()
    for _ in range(50):
        host.drive(4000)
        host.tick()
    assert host.board.owner == SESSION
    before = host.board.truth()
    host.board.reset()
    assert (host.board.applied_mV, host.board.enable, host.board.state) == (0, False, State.BOOT)
    assert host.board.owner == 0
    sample = host.tick()
    assert (sample.tick, sample.voltage_mV, sample.state) == (0, 0, State.IDLE)
    assert 0.0 < host.board.truth().position - before.position < 0.01
    assert host.parameter(Parameter.BOOT_COUNT) == 2
    assert host.parameter(Parameter.RESET_CAUSE) == 2


def test_stop_between_ticks_is_the_voltage_of_that_period() -> None:
    host = Host()
    host.arm()
    host.drive(2000)
    host.tick()
    host.drive(2000)
    assert host.tick().voltage_mV == 2000
    host.say(Stop(0))
    assert host.tick().voltage_mV == 0


def test_what_is_not_fetched_is_counted_and_does_not_grow() -> None:
    board = Board(bench(), carrier="cobs")
    for _ in range(1000):
        board.tick()
    receiver = cobs.CobsDecoder()
    assert len(board.transmit()) <= 4096
    for _ in range(100):
        board.tick()
    messages = [unpack(frame, 0) for frame in receiver.feed(board.transmit())]
    assert {m.ring_overruns for m in messages if isinstance(m, Health)} == {255}
    assert receiver.corrupt == 0


def test_encoder_that_no_board_has_is_refused() -> None:
    with pytest.raises(ConfigError, match="counts_per_rev"):
        Board(bench("encoder.counts_per_rev=ideal"))
