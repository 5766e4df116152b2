"""What a device says is checked before it is used: no answer leads to a traceback or an armed motor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import ConfigError, OpenError
from dcmp_hil.wire.messages import (
    Identity,
    Parameter,
    SampleReport,
    State,
)
from tests.contract.benches import on_bench
from tests.contract.driving import at_rest, drive
from tests.contract.hooks import on_way_down
from tests.contract.lies import SHORT_BOOT_WAIT, at_first, every, forgets, lying, says

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.wire.messages import Message

    Lie = Callable[[Message], Message | None]

pytestmark = pytest.mark.usefixtures("needs_compiler")

INT32_MAX = 2**31 - 1
_IMPOSSIBLE = [
    *((Parameter.COUNTS_PER_REV, value) for value in (0, -1, -(2**31), INT32_MAX)),
    *((Parameter.PERIOD_US, value) for value in (0, -1, -(2**31), INT32_MAX, 1)),
    *((Parameter.VOLTAGE_LIMIT_MV, value) for value in (0, -1, -(2**31), INT32_MAX)),
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
    with on_bench("sim-board can", SHORT_BOOT_WAIT) as bench:
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
