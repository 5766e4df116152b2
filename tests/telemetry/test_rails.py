"""Axes with three numbers: where they end, and the invisible lines that lead them there."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.rerun.plots import plots
from dcmp_hil.telemetry.rerun.rails import Rails, reach_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.telemetry.runs import VIEW, blocks, feed, read_back, values

if TYPE_CHECKING:
    from pathlib import Path

_NUMBER_PX = 22.0  # that a step of 10^k needs to have a number
_PLOT_PX, _LOW_PLOT_PX = 88.0, 70.0  # height of a plot on a screen of 768: while it runs, after a trip


@pytest.mark.parametrize(
    ("most", "end"),
    [
        *((0.0, 1.05), (0.3, 1.05), (math.nan, 1.05), (1.05, 1.05), (1.06, 1.5), (1.6, 1.9), (1.9, 1.9)),
        *((1.91, 10.5), (9.9, 10.5), (10.0, 10.5), (10.6, 15.0), (99.0, 105.0), (12.0, 15.0), (4e5, 1.05e6)),
    ],
)
def test_an_axis_ends_just_above_a_power_of_ten_or_a_little_more(most: float, end: float) -> None:
    assert reach_of(most) == pytest.approx(end)


@given(st.floats(0.0, 1e9), st.booleans())
def test_every_axis_holds_its_values_and_has_three_numbers(most: float, coarse: bool) -> None:
    end = reach_of(most, coarse=coarse)
    assert end >= most
    step = 10.0 ** math.floor(math.log10(end))
    height = _LOW_PLOT_PX if coarse else _PLOT_PX
    assert height * step / (2.0 * end) >= _NUMBER_PX
    assert end <= max(1.05, (7.1 if coarse else 5.6) * most)


def _rails(t: list[float], most: list[float]) -> tuple[Rails, list[tuple[float, float]]]:
    rails = Rails()
    times, ends = rails.add(np.array(t), np.array(most)[:, None])
    return rails, [*zip(times.tolist(), ends.tolist(), strict=True)]


def test_rows_come_once_a_second_and_where_the_values_grow() -> None:
    rails, rows = _rails([0.0, 0.1, 0.9, 1.0, 1.5, 2.0, 3.0], [0.5, -1.3, 0.2, 0.3, 0.1, math.nan, 7.0])
    assert [t for t, _ in rows] == [0.0, 1.0, 2.0, 3.0]
    assert [end for _, end in rows] == pytest.approx([1.5, 1.5, 1.05, 10.5])
    again, ends = rails.add(np.array([3.4, 3.5]), np.array([[0.0], [12.0]]))
    assert again.tolist() == [3.4]
    assert ends == pytest.approx([15.0])
    assert len(rails.add(np.array([3.6]), np.array([[14.0]]))[0]) == 0


def test_the_axis_is_that_of_the_last_six_seconds_and_holds_the_least() -> None:
    rails, _ = _rails([0.5, 1.5, 6.5], [70.0, 8.0, 1.0])
    assert [rails.reach(t) for t in (5.9, 6.5, 7.1)] == pytest.approx([105.0, 10.5, 1.05])
    limited = Rails(least=10.0)
    assert limited.add(np.array([0.0]), np.array([[0.1]]))[1] == pytest.approx([10.5])


def test_no_end_of_an_axis_is_short_of_what_is_drawn(tmp_path: Path) -> None:
    feed(RerunSink(VIEW, tmp_path / "run.rrd", "none"), periods=4000)
    for plot in ("joint/position_rad", "control/voltage_V", "errors/position_mrad", "loop/timing_us"):
        drawn = np.nanmax(np.abs(values(tmp_path / "run.rrd", f"{plot}/lines")))
        rails = values(tmp_path / "run.rrd", f"{plot}/rails")
        assert (rails[:, 0] == -rails[:, 1]).all()
        assert rails.max() == pytest.approx(reach_of(max(drawn, 10.0 if plot.endswith("_V") else 0.0)))
        look = read_back(tmp_path / "run.rrd", f"{plot}/rails")
        assert look["SeriesLines:names"] == [["", ""]]
        assert look["SeriesLines:colors"] == [[0, 0]]
        assert 4 <= len(rails) <= 8


@pytest.mark.parametrize("value", [math.inf, -math.inf, 1.7e308])
def test_a_value_that_is_infinite_is_a_gap_and_one_that_is_huge_has_an_axis(
    tmp_path: Path, value: float
) -> None:
    made = blocks(300)
    for field in set(FIELDS) - {"t", "began", "fault"}:
        made[1].rows[50, FIELDS.index(field)] = value
    sink = RerunSink(replace(VIEW, voltage_limit=None), tmp_path / "run.rrd", "none")
    for block in made:
        sink.block(block)
    sink.close()
    assert sink.warnings == []
    for plot in plots():
        lines = values(tmp_path / "run.rrd", f"{plot.path}/lines")
        assert np.isfinite(np.delete(lines, 150, axis=0)).all()
        assert not np.isinf(lines[150]).any()
        ends = values(tmp_path / "run.rrd", f"{plot.path}/rails")
        assert np.isfinite(ends).all()
        assert math.isfinite(value) or ends.max() < 1e6
