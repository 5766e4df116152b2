"""The board in this process: the plain simulated rig with a firmware in front, wires and all."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.values import Fault
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.counters import nearest
from dcmp_hil.wire.messages import (
    Drive,
    FaultReport,
    Health,
    Hello,
    Parameter,
    ParameterGet,
    ParameterValue,
    SampleReport,
    State,
    Stop,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from sim_backend.backend import SimBackend
from sim_backend.board.board import Board
from sim_backend.board.config import board_config
from tests.helpers import bench

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.values import Truth

pytestmark = pytest.mark.usefixtures("needs_compiler")

SESSION = 0x1234
Asked = TypeVar("Asked")


class Host:
    """As little of a host as will do, in frames."""

    def __init__(self, *overrides: str, **of_board: Any) -> None:
        self.rig = bench(*overrides)
        self.board = Board(self.rig, carrier="can", **of_board)
        self.seq = of_board.get("first_tick", 0) - 1
        self.heard: list[object] = []

    def say(self, message: Any) -> None:
        self.board.receive_frame(*pack(message, 0))

    def listen(self, kind: type[Asked]) -> list[Asked]:
        """Return what came since it was last asked for, of one kind."""
        messages = [unpack(frame, 0) for frame in self.board.transmit_frames()]
        self.heard += messages
        return [message for message in messages if isinstance(message, kind)]

    def tick(self) -> SampleReport:
        self.board.tick()
        self.seq += 1
        (sample,) = self.listen(SampleReport)
        return sample

    def drive(self, voltage_mV: int, *, arm: bool = True) -> None:
        self.say(Drive(voltage_mV, self.seq & 0x1FFF, arm, False, False, SESSION, 20))

    def arm(self) -> int:
        """Arm; return the number of the SAMPLE that the next DRIVE answers."""
        self.tick()
        self.say(Hello(SESSION, PROTOCOL_HASH))
        for _ in range(11):
            self.drive(0)
            self.tick()
        assert self.board.state == State.RUN
        return self.board.tick_count - 1

    def parameter(self, number: int) -> int:
        self.say(ParameterGet(number))
        (answer,) = self.listen(ParameterValue)
        return answer.value


def controller(k: int, position: float) -> float:
    """Return a voltage that the wire carries exactly, from what a host knows."""
    return round(1e3 * (6.0 * math.sin(0.05 * k) - 20.0 * position)) / 1e3


def on_the_board(host: Host, periods: int, mV_per_V: int = 1000, rad: float = math.tau / 4096) -> list[Any]:
    first, seen, count = host.arm(), [], 0
    sample = None
    for k in range(first, first + periods):
        if sample is not None:
            count = nearest(count, sample.position_counts, 24)
        position = rad * count
        if sample is not None:
            seen.append((position, sample.voltage_mV / mV_per_V, host.board.truth()))
        host.drive(round(mV_per_V * controller(k, position)))
        sample = host.tick()
    return seen


def on_the_rig(overrides: tuple[str, ...], first: int, periods: int) -> list[Any]:
    seen = []
    with SimBackend(bench(*overrides), SimulatedClock()) as backend:
        position = 0.0
        for _ in range(first + 1):
            backend.read()
            backend.write(0.0)
        for k in range(first, first + periods):
            if k > first:
                sample = backend.read()
                position = sample.position
                seen.append((position, sample.voltage, backend.truth()))
            backend.write(controller(k, position))
    return seen


@pytest.mark.parametrize(
    "overrides",
    [
        (),
        ("sim.integrator=euler",),
        ("loop.rate_hz=250.0",),
        ("amplifier.voltage_limit_V=2.5",),
        ("amplifier.slew_V_s=500.0",),
        ("sim.encoder_noise_counts=2.0", "sim.seed=7"),
    ],
    ids=str,
)
def test_board_is_the_plain_simulated_rig_to_the_bit(overrides: tuple[str, ...]) -> None:
    board, rig = on_the_board(Host(*overrides), 400), on_the_rig(overrides, 11, 400)
    assert [sample[:2] for sample in board] == [sample[:2] for sample in rig]
    assert [sample[2][:2] for sample in board] == [sample[2][:2] for sample in rig]
    assert max(abs(sample[1]) for sample in board) > 2.0


@pytest.mark.parametrize("signs", [(1, -1), (-1, 1), (-1, -1)])
def test_host_that_knows_the_wiring_sees_no_difference(signs: tuple[int, int]) -> None:
    wiring = (f"encoder.sign={signs[0]}", f"amplifier.sign={signs[1]}")
    straight = on_the_board(Host(), 300)
    wired = on_the_board(Host(*wiring), 300, mV_per_V=1000 * signs[1], rad=signs[0] * math.tau / 4096)
    assert wired == straight


def test_amplifier_beyond_the_board_has_the_shortcomings_of_the_rig() -> None:
    # The board reports what it puts out; only the plant knows what became of it.
    overrides = ("sim.dead_zone_V=0.5", "sim.voltage_step_mV=200.0")

    def open_loop(step: Callable[[float], Truth]) -> list[Truth]:
        return [step(round(3e3 * math.sin(0.03 * k)) / 1e3) for k in range(200)]

    host = Host(*overrides)
    first = host.arm()

    def board(voltage: float) -> Truth:
        host.drive(round(1e3 * voltage))
        host.tick()
        return host.board.truth()

    with SimBackend(bench(*overrides), SimulatedClock()) as backend:

        def rig(voltage: float) -> Truth:
            backend.write(voltage)
            backend.read()
            return backend.truth()

        for _ in range(first + 1):
            backend.write(0.0)
            backend.read()
        plain = open_loop(rig)
    assert [truth[:2] for truth in open_loop(board)] == [truth[:2] for truth in plain]


@pytest.mark.parametrize("carrier", ["cobs", "slcan"])
def test_carriers_carry_the_same_frames(carrier: str) -> None:
    frames, stream = Board(bench(), carrier="can"), Board(bench(), carrier=carrier)
    encode = cobs.encode if carrier == "cobs" else slcan.encode
    receiver = cobs.Receiver() if carrier == "cobs" else slcan.Receiver()
    for k in range(250):
        for board in (frames, stream):
            board.tick()
        for message in (ParameterGet(k % 16), Hello(k, PROTOCOL_HASH)):
            frames.receive_frame(*pack(message, 0))
            stream.receive(encode(pack(message, 0)))
        assert receiver.feed(stream.transmit()) == list(frames.transmit_frames())
    assert receiver.corrupt == 0
    assert (stream.transmit(), frames.transmit_frames()) == (b"", [])


def test_slcan_commands_are_answered_before_the_next_tick() -> None:
    board = Board(bench(), carrier="slcan")
    board.receive(b"V\rN\r?\r")
    assert board.transmit() == b"V0101\rNDCMP\r\a"
    board.receive(b"C\r")
    board.tick()
    assert board.transmit() == b"\r"


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
    turned = nearest(0, sample.position_counts - offset, 24)
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
    receiver = cobs.Receiver()
    assert len(board.transmit()) <= 4096
    for _ in range(100):
        board.tick()
    messages = [unpack(frame, 0) for frame in receiver.feed(board.transmit())]
    assert {m.ring_overruns for m in messages if isinstance(m, Health)} == {255}
    assert receiver.corrupt == 0


def test_encoder_that_no_board_has_is_refused() -> None:
    with pytest.raises(ConfigError, match="counts_per_rev"):
        Board(bench("encoder.counts_per_rev=ideal"))
