"""Blocks, and the reference at each sample's own instant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.ipc.ring import Ring
from dcmp_hil.telemetry.block import Block, ReferenceAligner
from dcmp_hil.telemetry.signals import SIGNALS, by_plot, columns
from dcmp_hil.values import UNKNOWN_TRUTH, Reference, Truth
from tests.helpers import T, cycle

if TYPE_CHECKING:
    from collections.abc import Iterable


class Trajectory:
    """A sine that counts how often it is asked."""

    def __init__(self) -> None:
        self.asked: list[float] = []

    def __call__(self, t: float) -> Reference:
        self.asked.append(t)
        return at(t)


def at(t: float) -> Reference:
    return Reference(math.sin(t), math.cos(t), -math.sin(t))


def block_of(
    aligner: ReferenceAligner, ticks: Iterable[int], delay: float, truth: Truth = UNKNOWN_TRUTH
) -> Block:
    ring = Ring(1024)
    for k in ticks:
        ahead = at(k * T + delay)
        now, began = aligner.now(k * T, ahead)
        ring.push(cycle(k * T, position=0.5)._replace(reference=ahead), truth, now, began)
    return Block(ring.drain())


def assert_reference(block: Block) -> None:
    expected = np.array([at(t) for t in block["t"].tolist()])
    assert block.reference == pytest.approx(expected, abs=1e-12)


def test_without_delay_the_reference_is_the_row_s_own() -> None:
    trajectory = Trajectory()
    assert_reference(block_of(ReferenceAligner(trajectory, 0.0), range(50), 0.0))
    assert trajectory.asked == []


def test_with_a_delay_it_is_that_of_the_row_before() -> None:
    trajectory = Trajectory()
    assert_reference(block_of(ReferenceAligner(trajectory, T), range(60), T))
    assert trajectory.asked == [0.0]  # only the very first has none before it


def test_after_lost_rows_the_trajectory_is_asked() -> None:
    trajectory = Trajectory()
    ticks = [k for k in range(100) if k not in {7, 40, 41, 42}]
    assert_reference(block_of(ReferenceAligner(trajectory, T), ticks, T))
    assert trajectory.asked == pytest.approx([0.0, 8 * T, 43 * T])


def test_where_it_begins_the_trajectory_is_asked_and_no_error_is_told_before() -> None:
    trajectory, began = Trajectory(), [math.inf]
    aligner = ReferenceAligner(trajectory, T, lambda: began[0])
    before = block_of(aligner, range(5), T)
    began[0] = 5 * T
    after = block_of(aligner, range(5, 10), T)
    assert trajectory.asked == pytest.approx([0.0, 5 * T])
    assert_reference(after)
    assert np.isnan(before.tracking_error).all()
    assert not np.isnan(after.tracking_error).any()


def test_a_block_without_rows_has_columns_all_the_same() -> None:
    block = block_of(ReferenceAligner(at, T), [], T)
    assert len(block) == len(block["t"]) == len(block.tracking_error) == 0


@pytest.mark.parametrize(("truth", "position"), [(UNKNOWN_TRUTH, 0.5), (Truth(0.7, 0.0, 0.0), 0.7)])
def test_tracking_error_is_of_the_true_position_where_it_is_known(truth: Truth, position: float) -> None:
    block = block_of(ReferenceAligner(at, 0.0), range(5), 0.0, truth)
    expected = position - np.array([math.sin(k * T) for k in range(5)])
    assert block.tracking_error == pytest.approx(expected, abs=1e-12)


def test_columns_are_the_table_of_signals() -> None:
    block = block_of(ReferenceAligner(at, 0.0), range(5), 0.0)
    table = columns(block)
    assert list(table) == ["time_s", *(signal.column for signal in SIGNALS)]
    assert all(values.shape == (5,) for values in table.values())
    assert table["tracking_error_mrad"] == pytest.approx(1e3 * block.tracking_error)
    assert table["period_us"] == pytest.approx(np.full(5, 1000.0))


def test_plots_hold_every_signal_once() -> None:
    plots = by_plot()
    assert sum(len(signals) for signals in plots.values()) == len(SIGNALS)
    assert all(signal.plot == plot for plot, signals in plots.items() for signal in signals)
