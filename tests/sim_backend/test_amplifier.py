"""The amplifier: commanded to applied voltage."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_backend.amplifier import Amplifier


def _amplifier(
    *,
    limit: float = 10.0,
    slew: float = math.inf,
    dead_zone: float = 0.0,
    quantum: float = 0.0,
    delay: int = 0,
) -> Amplifier:
    made = Amplifier(limit=limit, slew=slew, dead_zone=dead_zone, quantum=quantum, delay_samples=delay)
    made.live = True
    return made


def _applied(amplifier: Amplifier, commands: list[float]) -> list[float]:
    voltages = []
    for command in commands:
        amplifier.command(command)
        voltages.append(amplifier.step())
    return voltages


@pytest.mark.parametrize(
    ("delay", "expected"), [(0, [1.0, 2.0, 3.0]), (1, [0.0, 1.0, 2.0]), (2, [0.0, 0.0, 1.0])]
)
def test_amplifier_applies_a_command_after_its_delay(delay: int, expected: list[float]) -> None:
    assert _applied(_amplifier(delay=delay), [1.0, 2.0, 3.0]) == expected


def test_amplifier_holds_the_newest_command_when_none_comes() -> None:
    amplifier = _amplifier(delay=1)
    amplifier.command(3.0)
    assert [amplifier.step() for _ in range(4)] == [0.0, 3.0, 3.0, 3.0]
    amplifier.command(5.0)
    amplifier.command(-1.0)  # a queue of old commands is not played back
    assert [amplifier.step() for _ in range(2)] == [3.0, -1.0]


@pytest.mark.parametrize("command", [10.0, -10.0, 10.5, -1175.0, 1e300])
def test_amplifier_stops_at_its_limit(command: float) -> None:
    assert _applied(_amplifier(), [command]) == [math.copysign(10.0, command)]
    assert _applied(_amplifier(limit=math.inf), [command]) == [command]


@pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf])
def test_amplifier_takes_zero_when_a_command_is_not_finite(command: float) -> None:
    assert _applied(_amplifier(), [4.0, command, 5.0]) == [4.0, 0.0, 5.0]


def test_amplifier_slews() -> None:
    got = _applied(_amplifier(slew=0.5), [1.2, 1.2, 1.2, 1.2, -1.0, -1.0])
    assert got == pytest.approx([0.5, 1.0, 1.2, 1.2, 0.7, 0.2])


def test_amplifier_puts_out_nothing_inside_its_dead_zone() -> None:
    got = _applied(_amplifier(dead_zone=0.3), [0.29, 0.3, 0.31, -0.29, -0.3])
    assert got == [0.0, 0.3, 0.31, 0.0, -0.3]


def test_amplifier_puts_out_whole_steps() -> None:
    got = _applied(_amplifier(quantum=0.04), [0.019, 0.021, 1.0, -0.5])
    assert got == pytest.approx([0.0, 0.04, 1.0, -0.48])


def test_amplifier_leaves_its_dead_zone_when_it_slews_slowly() -> None:
    # 0.1 V a period towards 1 V with a dead zone of 0.25 V: nothing for two periods, then the ramp
    got = _applied(_amplifier(slew=0.1, dead_zone=0.25), [1.0] * 12)
    assert got == pytest.approx([0.0, 0.0, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.0, 1.0])


def test_amplifier_reaches_its_command_when_the_slew_is_less_than_a_step() -> None:
    got = _applied(_amplifier(slew=0.004, quantum=0.01), [1.0] * 300)
    assert got[-1] == pytest.approx(1.0)
    assert got[124] == pytest.approx(0.5)


@given(
    commands=st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=30),
    slew=st.one_of(st.just(math.inf), st.floats(0.001, 20.0)),
    dead_zone=st.one_of(st.just(0.0), st.floats(0.0, 2.0)),
    quantum=st.one_of(st.just(0.0), st.floats(0.001, 2.0)),
    delay=st.integers(0, 1),
)
def test_amplifier_never_exceeds_its_limit(
    commands: list[float], slew: float, dead_zone: float, quantum: float, delay: int
) -> None:
    amplifier = _amplifier(slew=slew, dead_zone=dead_zone, quantum=quantum, delay=delay)
    for voltage in _applied(amplifier, commands):
        assert abs(voltage) <= 10.0
        assert voltage == 0.0 or abs(voltage) >= dead_zone


def test_amplifier_is_silent_until_it_lives_and_after_its_release() -> None:
    amplifier = _amplifier(delay=1)
    amplifier.live = False
    assert _applied(amplifier, [5.0, 5.0]) == [0.0, 0.0]
    amplifier.live = True
    assert _applied(amplifier, [5.0, 5.0])[-1] == 5.0
    amplifier.release()
    assert _applied(amplifier, [5.0, 5.0]) == [0.0, 0.0]
    amplifier.release()
    amplifier.live = True
    assert amplifier.step() == 0.0, "nothing old may come out when it is switched on again"
