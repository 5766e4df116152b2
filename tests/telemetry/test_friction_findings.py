"""Friction as an observer found it: mean, deviation, and how often the observer let go of its model."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.control.model import Model
from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.friction_findings import FrictionFindings, FrictionStatistics
from dcmp_hil.telemetry.statistics import Statistics

_NAMES = ("friction_found_rad_s2", "distrust")


def _block(found: list[float], distrust: list[float], f1: float = 1.3) -> Block:
    rows = np.zeros((len(found), len(FIELDS) + 2))
    rows[:, 0] = np.arange(len(found))
    rows[:, -2], rows[:, -1] = found, distrust
    return Block(rows, Model(f1=f1), _NAMES)


def _findings(block: Block, cuts: tuple[int, ...] = ()) -> FrictionFindings:
    statistics = FrictionStatistics()
    for rows in np.split(block.rows, cuts):
        if len(rows):
            statistics.add(block.with_rows(rows), slice(0, len(rows)))
    findings = statistics.findings()
    assert findings is not None
    return findings


def test_mean_and_deviation_are_of_the_cycles_since_it_last_let_go() -> None:
    found = [9.0] * 10 + [8.0] * 5 + [1.4, 1.6] * 15
    distrust = [1.0] * 10 + [12.0, 40.0, 30.0, 9.0, 2.5] + [1.0] * 30
    got = _findings(_block(found, distrust))
    assert got.found_rad_s2 == pytest.approx(1.5)
    assert got.deviation_rad_s2 == pytest.approx(0.1)
    assert (got.let_go, got.largest_distrust, got.largest_distrust_t_s) == (1, 40.0, 11.0)
    assert got.held_share == pytest.approx(30 / 45)
    assert got.offered is None  # it is off by two deviations


def test_it_lets_go_above_ten_and_is_back_below_two() -> None:
    distrust = [1.0, 9.9, 1.0, 10.1, 5.0, 11.0, 2.1, 1.9, 10.0, 10.5, 1.0, 30.0]
    got = _findings(_block([1.3] * len(distrust), distrust))
    assert got.let_go == 3
    assert got.largest_distrust == 30.0
    assert got.held_share == 1 / 12
    assert got.found_rad_s2 == 1.3  # of the one cycle in which it was back


@pytest.mark.parametrize(
    ("found", "model", "offered"),
    [(1.36, 1.3, None), (1.37, 1.3, 1.37), (1.2346, 1.3, 1.23), (1.2351, 1.3, None), (0.5, np.nan, None)],
)
def test_friction_that_differs_by_more_than_5_percent_is_offered(
    found: float, model: float, offered: float | None
) -> None:
    assert _findings(_block([found] * 100, [1.0] * 100, model)).offered == offered


def test_friction_is_not_offered_where_the_model_held_for_less_than_half_of_the_window() -> None:
    distrust = [1.0] * 60 + [50.0] + [1.0] * 50
    got = _findings(_block([2.0] * 111, distrust))
    assert got.found_rad_s2 == 2.0
    assert got.offered is None


def test_friction_is_not_offered_after_less_than_four_seconds_in_which_the_model_held() -> None:
    assert _findings(_block([2.0] * 4, [1.0] * 4)).offered is None
    assert _findings(_block([2.0] * 5, [1.0] * 5)).offered == 2.0
    assert _findings(_block([2.0] * 5, [1.0] * 3 + [np.nan] * 2)).offered is None


@pytest.mark.parametrize(("uncertainty", "offered"), [(0.3, None), (0.1, 1.5), (np.nan, 1.5)])
def test_friction_is_not_offered_where_the_observer_itself_is_less_sure_than_that(
    uncertainty: float, offered: float | None
) -> None:
    two = _block([1.5] * 100, [1.0] * 100)
    rows = np.hstack((two.rows, np.full((100, 1), uncertainty)))
    got = _findings(Block(rows, two.model, (*_NAMES, "friction_deviation_rad_s2")))
    assert got.offered == offered
    assert got.held_s == 99.0


def test_where_it_never_held_there_is_no_number() -> None:
    got = _findings(_block([2.0] * 20, [50.0] * 20))
    assert (got.found_rad_s2, got.deviation_rad_s2, got.held_share, got.offered) == (None, None, 0.0, None)
    assert (got.let_go, got.largest_distrust_t_s) == (1, 0.0)


def test_no_number_is_left_out() -> None:
    got = _findings(_block([1.3, np.nan, np.inf, 1.5], [1.0, 1.0, 1.0, np.nan]))
    assert got.found_rad_s2 == 1.3


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_blocks_cut_anywhere_give_the_same(data: st.DataObject) -> None:
    distrust = data.draw(st.lists(st.sampled_from([1.0, 1.5, 3.0, 9.0, 11.0, 40.0]), min_size=1, max_size=60))
    found = [1.3 + 0.01 * k for k in range(len(distrust))]
    block = _block(found, distrust)
    cuts = tuple(sorted(data.draw(st.lists(st.integers(0, len(distrust)), max_size=8))))
    whole, pieces = _findings(block), _findings(block, cuts)
    assert pieces.found_rad_s2 == pytest.approx(whole.found_rad_s2)
    assert pieces.deviation_rad_s2 == pytest.approx(whole.deviation_rad_s2, abs=1e-9)
    assert (pieces.let_go, pieces.largest_distrust, pieces.largest_distrust_t_s, pieces.held_share) == (
        *(whole.let_go, whole.largest_distrust, whole.largest_distrust_t_s, whole.held_share),
    )


def test_figures_count_inside_of_the_window_only() -> None:
    statistics = Statistics(1.0, window_from=20.0)
    statistics.block(_block([1.0] * 15 + [1.3] * 15, [50.0] * 10 + [1.0] * 20))
    got = statistics.summary(1.0).friction
    assert got is not None
    assert (got.found_rad_s2, got.let_go, got.held_share) == (1.3, 0, 1.0)


def test_other_observers_have_no_findings() -> None:
    statistics = Statistics(1.0)
    statistics.block(Block(np.zeros((5, len(FIELDS)))))
    assert statistics.summary(1.0).friction is None
