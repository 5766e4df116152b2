"""The bench of the observers: every kind has its row, and the ratio is that of each repetition."""

from __future__ import annotations

import pytest

from dcmp_hil.config.rig import KINDS
from tools.bench_observers import BASE, JUDGED, ObserverCosts, observer_costs


def test_every_kind_is_measured_in_every_repetition() -> None:
    costs = observer_costs(repetitions=2, seconds=0.2)
    assert set(costs.us) == set(KINDS["observer"]) - {"custom"}
    assert all(len(us) == 2 and min(us) > 0.0 for us in costs.us.values())


def test_ratios_are_those_of_the_repetitions() -> None:
    costs = ObserverCosts({BASE: [1.0, 2.0, 1.5], JUDGED: [2.5, 4.0, 6.0]})
    assert costs.ratios == pytest.approx([2.5, 2.0, 4.0])
