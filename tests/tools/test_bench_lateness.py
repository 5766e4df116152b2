"""The figures of the lateness bench: ratios of medians, and no judgement where C itself scatters."""

from __future__ import annotations

import pytest

from tools.bench_lateness import Lateness


def _lateness(c: list[float]) -> Lateness:
    return Lateness(1000.0, c, [110.0, 330.0, 120.0], [1.0, 1.0, 1.0], [0.0], [0.0])


def test_ratio_is_that_of_the_medians_with_the_range_of_the_pairs() -> None:
    found = _lateness([100.0, 110.0, 60.0])
    assert found.ratio(found.ours) == pytest.approx((1.2, 1.1, 3.0))


def test_goal_is_not_judged_when_c_scatters_by_more_than_two() -> None:
    assert _lateness([100.0, 110.0, 60.0]).goal == "<= 1.2"
    assert "not judged: C's own spread is 2.2" in _lateness([100.0, 110.0, 50.0]).goal
