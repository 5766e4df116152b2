"""The lines of every plot: what is drawn is what was measured, and nothing that is unknown."""

from __future__ import annotations

import dataclasses
from datetime import timedelta
from typing import TYPE_CHECKING

import numpy as np
import pytest
import rerun as rr

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.rerun.plots import plots
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.telemetry.runs import VIEW, T, at, blocks, feed, periods_of, read_back, values

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


_SINGLE_EPS = float(np.finfo(np.float32).eps)  # lines are drawn from singles; run.mcap has every bit


@pytest.fixture(autouse=True)
def _strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def test_every_line_arrives_to_the_last_bit_of_a_single_and_to_the_nanosecond(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    of = feed(RerunSink(VIEW, record, "none"))
    names = {
        "joint/position_rad": ("position_true_rad", "position_reference_rad"),
        "joint/velocity_rad_s": ("velocity_estimate_rad_s", "velocity_reference_rad_s"),
        "control/voltage_V": ("voltage_demand_V", "voltage_applied_V"),
        "loop/timing_us": ("lateness_us", "compute_us"),
    }
    expected = {plot: [of[name] for name in columns] for plot, columns in names.items()}
    velocity = of["velocity_true_rad_s"]
    expected["joint/disturbance_rad_s2"] = [
        *(of["disturbance_true_rad_s2"], of["disturbance_estimate_rad_s2"]),
        of["gravity_rad_s2"] + of["friction_rad_s2"],
    ]
    expected["errors/position_mrad"] = [
        of["tracking_error_mrad"],
        1e3 * (of["position_estimate_rad"] - of["position_true_rad"]),
    ]
    expected["errors/velocity_mrad_s"] = [
        1e3 * (velocity - of["velocity_reference_rad_s"]),
        1e3 * (of["velocity_estimate_rad_s"] - velocity),
    ]
    expected["errors/disturbance_rad_s2"] = [
        of["disturbance_estimate_rad_s2"] - of["disturbance_true_rad_s2"],
        of["unexplained_rad_s2"],
    ]
    assert expected.keys() == {plot.path for plot in plots()}
    for plot, lines in expected.items():
        np.testing.assert_array_equal(values(record, f"{plot}/lines"), np.stack(lines, axis=1).astype("f4"))
    table = read_back(record, "joint/position_rad/lines")
    assert periods_of(table) == list(range(1000))
    assert table["loop_time"] == [timedelta(milliseconds=k) for k in range(1000)]


def test_the_reference_shown_is_that_of_the_sample_s_own_instant(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    feed(RerunSink(VIEW, record, "none"))
    expected = [at(k * T).position for k in range(1000)]
    assert values(record, "joint/position_rad/lines")[:, 1] == pytest.approx(expected, abs=0.5 * _SINGLE_EPS)


def test_unknown_truth_is_left_out_and_lines_keep_their_names(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    feed(RerunSink(dataclasses.replace(VIEW, simulated=False), record, "none"), known=False)
    names = {plot.path: read_back(record, f"{plot.path}/lines")["SeriesLines:names"] for plot in plots()}
    assert names == {
        "joint/position_rad": [["measured", "reference"]],
        "joint/velocity_rad_s": [["estimate", "reference"]],
        "joint/disturbance_rad_s2": [["estimate", "gravity", "friction"]],
        "control/voltage_V": [["demanded", "applied"]],
        "errors/position_mrad": [["tracking", "est.-meas."]],
        "errors/velocity_mrad_s": [["tracking"]],
        "errors/disturbance_rad_s2": [["rest"]],
        "loop/timing_us": [["late", "compute"]],
    }
    assert values(record, "joint/velocity_rad_s/lines").shape == (1000, 2)


def test_truth_is_drawn_even_if_the_first_block_is_one_row_without_a_disturbance(tmp_path: Path) -> None:
    first, second = blocks(2, rows=1)
    first.rows[0, FIELDS.index("disturbance_true")] = np.nan  # the plant has not moved yet
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    sink.block(first)
    sink.block(second)
    sink.close()
    table = read_back(tmp_path / "run.rrd", "joint/disturbance_rad_s2/lines")
    assert table["SeriesLines:names"] == [["true", "estimate", "model"]]
    assert values(tmp_path / "run.rrd", "joint/disturbance_rad_s2/lines")[1, :2].tolist() == [2.5, 2.0]
