"""A4: an observer that is wrong leads the arm beyond a limit that believes it.

Attack: six kinds of wrong observer (they answer 0, have the wrong sign, are frozen, scaled by 0.1, garbage,
delayed), limits from 0.5 to 20 rad/s, arms that start anywhere.

Promise: when the voltage becomes 0, the simulated arm is no faster than `most_speed` says, once by the
host's own watch alone (the plain simulated rig has no firmware) and once by the device alone
(`monitors = "finite"`): at 2 rad/s and 4096 counts 2.6 rad/s and 3 rad/s. What gravity adds afterwards is
measured by `make limits`. No healthy arm is stopped before it has passed a limit, from any start.
"""

from __future__ import annotations

import math
import shutil
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.config import load_rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.safety.monitors import RangeMonitor
from dcmp_hil.values import Estimate, Sample
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import Parameter, ParameterGet, ParameterValue
from sim_backend.board.backend import SimBoardBackend
from tests.attacks.hostile import wrong_observers
from tests.attacks.limit_runs import (
    BY,
    LIMITS_RAD_S,
    NEEDED,
    Outcome,
    attack,
    attacked,
    healthy,
    most_speed,
    rig_under,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sim_backend.board.board import Board

ENDS = {"speed", "device_fault", "travel", "disturbance", "jump", "polarity", "stuck", "power"}
RUN_COUNT = 3
HEALTHY_RUNS = 5


def _most(by: str, limit: float, seed: int) -> float:
    return min(most_speed(rig_under(limit, seed), by), NEEDED.get((by, limit), math.inf))


def _found(outcomes: list[Outcome], most: float) -> list[Outcome]:
    return [outcome for outcome in outcomes if not outcome.speed <= most]


@pytest.mark.sampled
@pytest.mark.parametrize("first", range(0, 12, RUN_COUNT))
@pytest.mark.parametrize("kind", wrong_observers.KINDS)
@pytest.mark.parametrize("limit", LIMITS_RAD_S)
@pytest.mark.parametrize("by", BY)
def test_no_wrong_observer_leads_an_arm_beyond_its_limit(
    by: str, limit: float, kind: str, first: int
) -> None:
    outcomes = {seed: attack(limit, kind, seed, by) for seed in range(first, first + RUN_COUNT)}
    assert [one for seed, one in outcomes.items() if not one.speed <= _most(by, limit, seed)] == []


def test_an_encoder_whose_noise_is_large_has_the_bound_of_its_noise() -> None:
    """Its standard deviation is 0.44 counts: the arm was at 6.04 rad/s, and 6.02 is allowed without noise."""
    assert attack(5.0, "scaled by 0.1", 18, "device").speed <= _most("device", 5.0, 18)


@pytest.mark.parametrize("by", BY)
def test_two_rad_s_are_kept_against_an_observer_that_answers_0(by: str) -> None:
    """What was seen: a limit of 2 rad/s, an observer that answers 0, an arm at 11.9 rad/s."""
    outcomes = [attack(2.0, "answers 0", seed, by) for seed in range(100, 104)]
    assert _found(outcomes, NEEDED[by, 2.0]) == []
    assert {outcome.reason for outcome in outcomes} <= ENDS
    assert all(outcome.speed > 1.5 for outcome in outcomes)  # it did attack


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize(
    ("counts", "rate", "limit"), [(1024, 1000, 4.0), (4096, 200, 5.0), (16384, 2000, 1.0)]
)
def test_the_bound_follows_counts_and_rate(by: str, counts: int, rate: int, limit: float) -> None:
    overrides = (f"encoder.counts_per_rev={counts}", f"loop.rate_hz={rate}")
    most = most_speed(rig_under(limit, 1, *overrides), by)
    outcomes = [attack(limit, kind, 7, by, *overrides) for kind in wrong_observers.KINDS]
    assert _found(outcomes, most) == []


@pytest.mark.parametrize("by", BY)
def test_travel_is_kept_against_an_observer_that_answers_0(by: str) -> None:
    observer = f"observer.kind={wrong_observers.__name__}:Zero"
    for seed in range(4):
        limits = ("supervisor.position_limit_rad=1.0", f"sim.position_rad={0.9 * (-1) ** seed}")
        rig = rig_under(20.0, seed, observer, *BY[by], *limits)
        outcome = attacked(rig)
        assert abs(outcome.position) <= 1.0 + 3 * rig.period * most_speed(rig, by)
        assert outcome.reason in ENDS


@pytest.mark.sampled
@pytest.mark.parametrize("first", range(0, 200, HEALTHY_RUNS))
def test_no_healthy_arm_that_starts_anywhere_is_stopped(first: int) -> None:
    verdicts = {seed: healthy(seed) for seed in range(first, first + HEALTHY_RUNS)}
    assert {seed: verdict for seed, verdict in verdicts.items() if verdict.is_false} == {}


def _said(board: Board, parameter: Parameter) -> int:
    """Ask a board for a parameter."""
    board.receive_frame(*pack(ParameterGet(parameter), 0))
    answers = [unpack(frame, 0) for frame in board.transmit_frames()]
    return next(answer.value for answer in answers if isinstance(answer, ParameterValue))


def test_limits_reach_the_device_and_end_with_the_session() -> None:
    lower = ("amplifier.slew_V_s=700", "amplifier.voltage_limit_V=4", "encoder.zero=-300")
    rig = rig_under(2.0, 3, *BY["device"], "backend.carrier=can", *lower)
    backend = SimBoardBackend(rig, SimulatedClock())
    device = backend.board
    built = {parameter: _said(device, parameter) for parameter in _LIMITS}
    with backend:
        held = {parameter: _said(device, parameter) for parameter in _LIMITS}
        backend.read()
        backend.write(0.0)
    assert held == {
        Parameter.VOLTAGE_LIMIT_MV: 4000,
        Parameter.SLEW_MV_PER_MS: 700,
        Parameter.SPEED_LIMIT_COUNTS_S: 1428,
        Parameter.TRAVEL_LIMIT_COUNTS: 4096,
        Parameter.TRAVEL_ORIGIN_COUNTS: 2**24 - 300,
    }
    assert {parameter: _said(device, parameter) for parameter in _LIMITS} == built
    assert built[Parameter.SPEED_LIMIT_COUNTS_S] == 32_768


_LIMITS = (
    *(Parameter.VOLTAGE_LIMIT_MV, Parameter.SLEW_MV_PER_MS, Parameter.SPEED_LIMIT_COUNTS_S),
    *(Parameter.TRAVEL_LIMIT_COUNTS, Parameter.TRAVEL_ORIGIN_COUNTS),
)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_speed_that_is_no_number_is_no_speed(bad: float) -> None:
    ranges = RangeMonitor(6.0, 2.0, 0.2)
    stop = ranges.check(Sample(0.0, 0.0, 0.0), Estimate(0.0, bad, 0.0))
    assert stop is not None
    assert stop.reason == "speed"


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (
            ("supervisor.velocity_limit_rad_s=0.38",),
            r"velocity_limit_rad_s: got 0\.38; at least 0\.384 rad/s",
        ),
        (
            ("supervisor.velocity_limit_rad_s=1.5", "encoder.counts_per_rev=1024"),
            r"velocity_limit_rad_s: got 1\.5; at least 1\.534 rad/s",
        ),
        (
            ("supervisor.velocity_limit_rad_s=6", "encoder.counts_per_rev=256"),
            r"velocity_limit_rad_s: got 6; at least 6\.136 rad/s",
        ),
        (
            ("supervisor.velocity_limit_rad_s=0.3", "loop.rate_hz=100"),
            r"velocity_limit_rad_s: got 0\.3; at least 0\.307 rad/s",
        ),
        (
            ("supervisor.position_limit_rad=0.01", "encoder.counts_per_rev=256"),
            "position_limit_rad: got 0.01",
        ),
    ],
)
def test_a_limit_below_what_can_be_kept_is_refused(overrides: tuple[str, ...], words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        load_rig("bench-1khz", ("supervisor.start=immediate", *overrides))
    assert "Raise it" in str(caught.value)


@pytest.mark.parametrize("limit", ["0.5", "0.384"])
def test_the_lowest_limit_as_the_message_prints_it_is_taken(limit: str) -> None:
    rig = load_rig("bench-1khz", ("supervisor.start=immediate", f"supervisor.velocity_limit_rad_s={limit}"))
    assert rig.supervisor.velocity_limit_rad_s == float(limit)


def test_a_wrong_observer_is_stopped_by_the_real_script(script: Callable[..., Any], tmp_path: Path) -> None:
    """Through the command, with an observer beside the rig: exit 4, the sentence names who saw it."""
    shutil.copy(wrong_observers.__file__, tmp_path / "wrong_observers.py")
    done = script(
        *("run", "bench-1khz", "--fast", "--viewer", "none", "--duration", "3"),
        *("--set", "observer.kind=wrong_observers:Zero", "--set", "supervisor.velocity_limit_rad_s=2"),
        cwd=tmp_path,
        timeout=120,
    )
    assert done.code == 4, (done.out, done.err)
    said = " ".join((done.out + done.err).split())
    assert "by the supervisor's own observer; the limit is 2 rad/s" in said
    assert "Traceback" not in said
