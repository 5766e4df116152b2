"""Observers beside the loop in the dashboard: a line each, named by kind, in the plots of the loop's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.recording.export import to_rrd
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.telemetry.rerun.plots import plots
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.shadow_lines import shadow_lines
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.signals import SIGNALS
from tests.helpers import STEADY, bench
from tests.telemetry.runs import read_back, values

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.telemetry.recorder import Sink

KINDS = ("friction_kalman", "derivative")
FURTHER = tuple(
    name
    for kind in KINDS
    for name in (
        f"position_{kind}_rad",
        f"velocity_{kind}_rad_s",
        f"disturbance_{kind}_rad_s2",
        f"voltage_demand_{kind}_V",
    )
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, np.ndarray]]:
    """Return the folder of a run with two observers beside the loop, and its columns."""
    folder, rig = tmp_path_factory.mktemp("shadows"), bench(*STEADY)
    sinks: list[Sink] = [
        RecordingSink(folder / "run.mcap", rig.period, about(rig), rig_json(rig)),
        RerunSink(view_of(rig), folder / "run.rrd", "none"),
    ]
    result = run(rig, duration=1.0, fast=True, sinks=sinks, compare=KINDS)
    to_rrd(read_run(folder), folder / "export.rrd")
    return folder, result.columns


@pytest.mark.parametrize("file", ["run.rrd", "export.rrd"])
@pytest.mark.parametrize(
    ("plot", "column", "error"),
    [
        ("joint/velocity_rad_s", "velocity_{}_rad_s", None),
        ("joint/disturbance_rad_s2", "disturbance_{}_rad_s2", None),
        ("errors/velocity_mrad_s", "velocity_{}_rad_s", ("velocity_true_rad_s", 1e3)),
        ("errors/disturbance_rad_s2", "disturbance_{}_rad_s2", ("disturbance_true_rad_s2", 1.0)),
    ],
)
def test_each_has_a_line_of_its_name_behind_those_of_the_loop(
    recorded: tuple[Path, dict[str, np.ndarray]],
    file: str,
    plot: str,
    column: str,
    error: tuple[str, float] | None,
) -> None:
    folder, columns = recorded
    (names,) = read_back(folder / file, f"{plot}/lines")["SeriesLines:names"]
    assert isinstance(names, list)
    assert names[-2:] == list(KINDS)
    assert "estimate" in names[:-2]
    drawn = values(folder / file, f"{plot}/lines")
    for place, kind in zip((-2, -1), KINDS, strict=True):
        expected = columns[column.format(kind)]
        if error is not None:
            expected = error[1] * (expected - columns[error[0]])
        np.testing.assert_array_equal(drawn[:, place], expected.astype("f4"))


def test_their_colours_are_their_own() -> None:
    many = tuple(
        name
        for k in range(8)
        for name in (f"velocity_own_{k}_rad_s", f"position_own_{k}_rad", f"disturbance_own_{k}_rad_s2")
    )
    colours = {line.colour for line in shadow_lines(many)}
    assert len(colours) == 8
    assert not colours & {signal.colour for signal in SIGNALS}


def test_other_further_columns_are_no_observers() -> None:
    diagnosis = ("disturbance_found_rad_s2", "friction_found_rad_s2", "velocity_wind_rad_s")
    assert shadow_lines(diagnosis) == []
    without = {plot.path: len(plot.lines) for plot in plots()}
    grown = {plot.path: len(plot.lines) for plot in plots(FURTHER) if plot.path in without}
    assert {path: grown[path] - count for path, count in without.items() if grown[path] > count} == {
        "joint/velocity_rad_s": 2,
        "joint/disturbance_rad_s2": 2,
        "errors/velocity_mrad_s": 2,
        "errors/disturbance_rad_s2": 2,
    }
