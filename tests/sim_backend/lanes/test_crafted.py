"""Rare ends of a lane: broken observers, jumps, chatter at its limit, the way to 0 V."""

from __future__ import annotations

import pytest

from sim_backend.lanes.library import load
from tests.sim_backend.lanes import crafted


def test_the_first_check_that_objects_is_the_cause() -> None:
    not_finite, speed = crafted.NOT_FINITE, crafted.SPEED
    assert crafted.causes(load()) == [not_finite, speed, speed, not_finite]


def test_a_jump_passes_once_in_half_a_second_and_not_near_a_limit() -> None:
    assert crafted.jumps(load()) == [crafted.BY_LOOP] * 3


def test_chatter_is_judged_exactly_where_its_limit_is_near() -> None:
    assert crafted.chatter(load()) == [crafted.BY_LOOP, 0.0, crafted.WITH_EXACT, crafted.WITH_EXACT]


def test_chatter_is_half_a_second_without_a_pause_or_many_bursts() -> None:
    assert crafted.bursts(load()) == [0.0, 0.0, crafted.CHATTER, crafted.CHATTER]


def test_the_way_to_0_V_is_that_of_limits_and_slew_and_outlasts_the_run() -> None:
    causes, peaks = crafted.ramps(load())
    assert causes == [crafted.SPEED] * 5
    assert peaks[:2] == [pytest.approx(peaks[0])] * 2
    assert 0.0 < peaks[0] < peaks[2] < 5.0
    assert peaks[4] == 0.0
