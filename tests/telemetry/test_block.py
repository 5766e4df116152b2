"""Blocks, and the reference at each sample's own instant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.telemetry.block import Aligner, Block
from dcmp_hil.telemetry.ring import Ring
from dcmp_hil.telemetry.signals import SIGNALS, by_plot, columns
from dcmp_hil.values import UNKNOWN_TRUTH, Reference, Truth
from tests.helpers import T, cycle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray


class Trajectory:
    """A sine that counts how often it is asked."""

    def __init__(self) -> None:
        self.asked: list[float] = []

    def __call__(self, t: float) -> Reference:
        self.asked.append(t)
        return at(t)


def at(t: float) -> Reference:
    return Reference(math.sin(t), math.cos(t), -math.sin(t))


def rows(ticks: Iterable[int], delay: float, truth: Truth = UNKNOWN_TRUTH) -> NDArray[np.float64]:
    ring = Ring(1024)
    for k in ticks:
        ring.push(cycle(k * T, position=0.5)._replace(reference=at(k * T + delay)), truth)
    return ring.drain()


def assert_reference(block: Block) -> None:
    expected = np.array([at(t) for t in block["t"].tolist()])
    assert block.reference == pytest.approx(expected, abs=1e-12)


def test_without_delay_the_reference_is_the_row_s_own() -> None:
    trajectory = Trajectory()
    assert_reference(Aligner(trajectory, 0.0).block(rows(range(50), 0.0)))
    assert trajectory.asked == []


def test_with_a_delay_it_is_that_of_the_row_before_across_blocks_too() -> None:
    trajectory = Trajectory()
    aligner = Aligner(trajectory, T)
    for start in (0, 10, 25):
        assert_reference(aligner.block(rows(range(start, {0: 10, 10: 25, 25: 60}[start]), T)))
    assert trajectory.asked == [0.0]  # only the very first has nobody before it


def test_after_lost_rows_the_trajectory_is_asked() -> None:
    trajectory = Trajectory()
    ticks = [k for k in range(100) if k not in {7, 40, 41, 42}]
    assert_reference(Aligner(trajectory, T).block(rows(ticks, T)))
    assert trajectory.asked == pytest.approx([0.0, 8 * T, 43 * T])


def test_an_empty_block_changes_nothing() -> None:
    trajectory = Trajectory()
    aligner = Aligner(trajectory, T)
    aligner.block(rows(range(3), T))
    assert len(aligner.block(rows([], T))) == 0
    assert_reference(aligner.block(rows(range(3, 6), T)))
    assert trajectory.asked == [0.0]


@pytest.mark.parametrize(("truth", "position"), [(UNKNOWN_TRUTH, 0.5), (Truth(0.7, 0.0, 0.0), 0.7)])
def test_tracking_error_is_of_the_true_position_where_it_is_known(truth: Truth, position: float) -> None:
    block = Aligner(at, 0.0).block(rows(range(5), 0.0, truth))
    expected = position - np.array([math.sin(k * T) for k in range(5)])
    assert block.tracking_error == pytest.approx(expected, abs=1e-12)


def test_columns_are_the_table_of_signals() -> None:
    block = Aligner(at, 0.0).block(rows(range(5), 0.0))
    table = columns(block)
    assert list(table) == ["time_s", *(signal.column for signal in SIGNALS)]
    assert all(values.shape == (5,) for values in table.values())
    assert table["tracking_error_mrad"] == pytest.approx(1e3 * block.tracking_error)
    assert table["period_us"] == pytest.approx(np.full(5, 1000.0))


def test_plots_hold_every_signal_once() -> None:
    plots = by_plot()
    assert sum(len(signals) for signals in plots.values()) == len(SIGNALS)
    assert all(signal.plot == plot for plot, signals in plots.items() for signal in signals)
