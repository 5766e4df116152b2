"""What a device says is checked before it is used: no answer leads to a traceback, a STOP or a live motor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import ConfigError, OpenError
from dcmp_hil.values import Fault
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import (
    Drive,
    FaultReport,
    Identity,
    Parameter,
    ParameterValue,
    SampleReport,
    State,
    Stop,
    StopReason,
)
from tests.contract.benches import on_bench
from tests.contract.driving import at_rest, drive
from tests.contract.hooks import on_way_down
from tests.firmware.core_library import compiler

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message
    from tests.contract.benches import Bench

    Lie = Callable[[Message], Message | None]

_INT = 2**31 - 1
_FAST = "backend.boot_wait_s=0.5"


@pytest.fixture(scope="module", autouse=True)
def needs_compiler() -> None:
    compiler()


def lying(lie: Lie) -> Callable[[list[Frame]], list[Frame]]:
    """Pass every message of the device through `lie`; what becomes None is not sent."""

    def change(frames: list[Frame]) -> list[Frame]:
        told = (lie(unpack(frame)) for frame in frames)  # type: ignore[arg-type]
        return [pack(message) for message in told if message is not None]

    return change


def says(parameter: Parameter, value: int, result: int = 0) -> Lie:
    def lie(message: Message) -> Message:
        if isinstance(message, ParameterValue) and message.id == parameter:
            return ParameterValue(parameter, value, result)
        return message

    return lie


def at_first(parameter: Parameter, value: int) -> Lie:
    """Say a value until another is set: the first answer is the comparison's."""
    left = [1]

    def lie(message: Message) -> Message:
        if isinstance(message, ParameterValue) and message.id == parameter and left:
            left.pop()
            return ParameterValue(parameter, value, 0)
        return message

    return lie


def forgets(parameter: Parameter, value: int, answers: int) -> Lie:
    """Say another value after so many answers about the parameter: what was set is not kept."""
    heard = [0]

    def lie(message: Message) -> Message:
        if isinstance(message, ParameterValue) and message.id == parameter:
            heard[0] += 1
            if heard[0] > answers:
                return ParameterValue(parameter, value, 0)
        return message

    return lie


def every(kind: type, **fields: int | bool) -> Lie:
    return lambda message: message._replace(**fields) if isinstance(message, kind) else message  # type: ignore[arg-type]


_IMPOSSIBLE = [
    *((Parameter.COUNTS_PER_REV, value) for value in (0, -1, -(2**31), _INT)),
    *((Parameter.PERIOD_US, value) for value in (0, -1, -(2**31), _INT, 1)),
    *((Parameter.VOLTAGE_LIMIT_MV, value) for value in (0, -1, -(2**31), _INT)),
    *((Parameter.SLEW_MV_PER_MS, value) for value in (-1, -(2**31))),
    *((Parameter.SPEED_LIMIT_COUNTS_S, value) for value in (0, -1, -(2**31))),
    *((Parameter.TRAVEL_LIMIT_COUNTS, value) for value in (0, -1, -(2**31))),
    *((Parameter.SUPPLY_MV, value) for value in (-1, -(2**31))),
    *((Parameter.TICK, value) for value in (-1, -(2**31))),
]
_READ = sorted({parameter for parameter, _ in _IMPOSSIBLE})
_ROWS: list[tuple[str, Lie, str]] = [
    *(
        (f"{parameter.name} = {value}", says(parameter, value), f"{parameter.name} = {value}")
        for parameter, value in _IMPOSSIBLE
    ),
    *(
        (f"{parameter.name} refused with {result}", says(parameter, 5, result), parameter.name)
        for parameter in _READ
        for result in (1, 5, 99)
    ),
    ("TICK that is none of its samples'", says(Parameter.TICK, 2**30 + 100), "other ticks"),
    ("WATCHDOG_MS that is not taken", says(Parameter.WATCHDOG_MS, 1000), "WATCHDOG_MS"),
    ("owned and busy at once", every(Identity, busy=True, owned=True), "cannot be"),
    ("a mismatch of equal hashes", every(Identity, mismatch=True), "cannot be"),
    ("another hash", every(Identity, protocol_hash=7), "00000007"),
    ("a voltage before it is armed", every(SampleReport, voltage_mV=3000, state=State.IDLE), "3 V"),
    ("a state that does not exist", every(SampleReport, state=7), "unknown state"),
    ("ticks that stand still", every(SampleReport, tick=9), "cannot be|did not arm|other ticks"),
    ("no SAMPLE at all", lambda m: None if isinstance(m, SampleReport) else m, "HEALTH arrives"),
    ("no IDENTITY", lambda m: None if isinstance(m, Identity) else m, "does not answer"),
]


@pytest.mark.sampled
@pytest.mark.parametrize(("lie", "words"), [row[1:] for row in _ROWS], ids=[row[0] for row in _ROWS])
def test_an_answer_that_cannot_be_is_a_sentence_and_leaves_the_device_free(lie: Lie, words: str) -> None:
    with on_bench("sim-board can", _FAST) as bench:
        on_way_down(bench, lying(lie))
        with pytest.raises((OpenError, ConfigError), match=words) as caught:
            bench.make().__enter__()
        assert "\n" not in str(caught.value)
        assert at_rest(bench)
        assert bench.board.state == State.IDLE
        for _ in range(600):  # where the session could not be given back, it lapses
            bench.board.tick()
        assert bench.board.owner == 0


@pytest.mark.parametrize(
    ("parameter", "answers"),
    [
        *((Parameter.SPEED_LIMIT_COUNTS_S, 2), (Parameter.TRAVEL_LIMIT_COUNTS, 2)),
        *((Parameter.VOLTAGE_LIMIT_MV, 2), (Parameter.SLEW_MV_PER_MS, 2)),
        *((Parameter.WATCHDOG_MS, 1), (Parameter.TRAVEL_ORIGIN_COUNTS, 1)),
    ],
)
def test_a_limit_that_is_taken_and_not_kept_is_refused_before_arming(
    parameter: Parameter, answers: int
) -> None:
    with on_bench("sim-board can", "amplifier.slew_V_s=500", "encoder.zero=3") as bench:
        on_way_down(bench, lying(forgets(parameter, 49, answers)))
        with pytest.raises(OpenError, match=rf"{parameter.name} was set to \d+, and reads 49") as caught:
            bench.make().__enter__()
        assert "\n" not in str(caught.value)
        assert bench.board.state == State.IDLE
        assert bench.board.owner == 0


@pytest.mark.parametrize(
    ("parameter", "value", "words"),
    [
        (
            Parameter.SPEED_LIMIT_COUNTS_S,
            8192,
            r"velocity_limit_rad_s: the rig says 20, the device allows 12\.566\.",
        ),
        (
            Parameter.TRAVEL_LIMIT_COUNTS,
            2048,
            r"position_limit_rad: the rig says 6\.2832, the device allows 3\.141\.",
        ),
        (Parameter.VOLTAGE_LIMIT_MV, 5000, "amplifier.voltage_limit_V: the rig says 10, the device allows 5"),
        (Parameter.SLEW_MV_PER_MS, 100, "amplifier.slew_V_s: the rig says 500, the device allows 100"),
    ],
)
def test_limits_below_the_rigs_are_named_before_arming(parameter: Parameter, value: int, words: str) -> None:
    with on_bench("sim-board can", "amplifier.slew_V_s=500") as bench:
        on_way_down(bench, lying(says(parameter, value)))
        with pytest.raises(ConfigError, match=words) as caught:
            bench.make().__enter__()
        assert "Lower it in the rig" in str(caught.value)
        assert bench.board.state == State.IDLE
        assert bench.board.owner == 0


@pytest.mark.parametrize(
    ("rig", "device_mV", "words"),
    [
        ("none", 24_000, r'amplifier\.supply_V: the rig says "none", .* 24 V \(PWM\).*--supply-V'),
        ("10.0", 24_000, r"amplifier\.supply_V: the rig says 10, .* 24 V \(PWM\)"),
        ("24.0", 12_500, r"amplifier\.supply_V: the rig says 24, .* 12\.5 V \(PWM\)"),
        ("24.0", 0, r'amplifier\.supply_V: the rig says 24, but this board divides no supply.*"none"'),
    ],
)
def test_another_supply_than_the_rigs_is_named_before_arming(rig: str, device_mV: int, words: str) -> None:
    with on_bench("sim-board can", f"amplifier.supply_V={rig}") as bench:
        on_way_down(bench, lying(says(Parameter.SUPPLY_MV, device_mV)))
        with pytest.raises(ConfigError, match=words):
            bench.make().__enter__()
        assert bench.board.state == State.IDLE
        assert bench.board.owner == 0


def test_the_same_supply_on_both_sides_arms() -> None:
    with on_bench("sim-board can", "amplifier.supply_V=24.0") as bench, bench.make() as backend:
        drive(backend, 0.0, 3)
        assert bench.board.state == State.RUN


def test_a_limit_of_the_rig_as_the_message_prints_it_is_accepted() -> None:
    limits = ("supervisor.velocity_limit_rad_s=12.566", "supervisor.position_limit_rad=3.141")
    both = at_first(Parameter.SPEED_LIMIT_COUNTS_S, 8192), at_first(Parameter.TRAVEL_LIMIT_COUNTS, 2048)
    with on_bench("sim-board can", *limits) as bench:
        on_way_down(bench, lying(lambda message: both[1](both[0](message))))  # type: ignore[arg-type]
        with bench.make() as backend:
            drive(backend, 0.0, 3)


def test_a_slew_that_the_rig_does_not_know_is_remarked() -> None:
    with on_bench("sim-board can") as bench:
        on_way_down(bench, lying(says(Parameter.SLEW_MV_PER_MS, 100)))
        with bench.device() as backend:
            (remark,) = backend.remarks
    assert "100 V/s" in remark


# -------------------------------------------------------------------------------------------- clearing


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


# ----------------------------------------------------------------------------------------- two devices


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
    with on_bench("sim-board can", _FAST) as bench, on_bench("sim-board can", first_tick=100) as other:
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
