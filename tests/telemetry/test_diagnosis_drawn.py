"""The diagnosis of an observer in the dashboard: plots and a lane of their own, and only where it exists."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rerun as rr

from dcmp_hil import run
from dcmp_hil.recording import export
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.telemetry.rerun.blueprint import dashboard
from dcmp_hil.telemetry.rerun.plots import plots
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.helpers import STEADY, bench
from tests.telemetry.runs import read_back, values
from tests.test_registries import views

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from dcmp_hil.telemetry.dispatcher import Sink
    from dcmp_hil.telemetry.sink_factories import SinkMaker

_OWN = {"observer/disturbance_rad_s2", "observer/friction_rad_s2"}
_RIG = bench(*STEADY, "observer.kind=friction_kalman", "supervisor.disturbance_limit_rad_s2=1000")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, NDArray[np.float64]]]:
    """Return the folder of a run that is pushed at 2 s, and its columns."""
    folder = tmp_path_factory.mktemp("drawn")
    rr.set_strict_mode(True)
    sinks: list[Sink | SinkMaker] = [
        RerunSink(view_of(_RIG), folder / "run.rrd", "none"),
        RecordingSink(folder / "run.mcap", _RIG.period, about(_RIG), rig_json(_RIG)),
    ]
    push = ["plant.push:rad_s2=15,ms=300,at=2s,for=1s"]
    columns = run(_RIG, duration=4.0, fast=True, sinks=sinks, faults=push).columns
    rr.set_strict_mode(False)
    return folder, columns


def test_layout_has_a_place_for_the_diagnosis_of_that_observer_only() -> None:
    for tripped in (False, True):
        layouts = (dashboard(view_of(rig), tripped=tripped).root_container for rig in (_RIG, bench()))
        with_it, without = ([str(view.origin) for view in views(layout)] for layout in layouts)
        assert all(with_it.count(path) == 1 for path in _OWN)
        assert set(with_it) - set(without) == _OWN
        assert set(without) <= set(with_it)


def test_plots_with_a_diagnosis_are_named_with_their_unit() -> None:
    more = [plot for plot in plots(view_of(_RIG).further) if plot not in plots()]
    assert {plot.path for plot in more} == _OWN
    assert all(plot.titled.endswith("[rad/s²]") for plot in more)


def test_friction_is_drawn_as_its_difference_from_the_model_beside_its_deviation(
    drawn: tuple[Path, dict[str, NDArray[np.float64]]],
) -> None:
    folder, of = drawn
    deviation = of["friction_deviation_rad_s2"]
    lines = [of["friction_found_rad_s2"] - 1.3, deviation, -deviation]
    for record in (folder / "run.rrd", _exported(folder)):
        got = values(record, "observer/friction_rad_s2/lines")
        np.testing.assert_array_equal(got, np.stack(lines, axis=1).astype("f4"))
        got = values(record, "observer/disturbance_rad_s2/lines")
        np.testing.assert_array_equal(got[:, 0], of["disturbance_found_rad_s2"].astype("f4"))


def _exported(folder: Path) -> Path:
    place = folder / "exported.rrd"
    export.to_rrd(read_run(folder), place)
    return place


def test_a_lane_says_where_the_observer_let_go_of_its_model(
    drawn: tuple[Path, dict[str, NDArray[np.float64]]],
) -> None:
    folder, of = drawn
    table: dict[str, list[Any]] = dict(read_back(folder / "run.rrd", "model"))
    states = [state for (state,) in table["StateChange:state"]]
    times = [one.total_seconds() for one in table["loop_time"]]
    assert states[-3:] == ["holds", "let go", "holds"]
    t, distrust = of["time_s"], of["distrust"]
    assert times[-2] == pytest.approx(t[(t > 2.0) & (distrust > 10.0)][0])
    assert times[-1] == pytest.approx(t[(t > times[-2]) & (distrust < 2.0)][0])
    assert 2.0 < times[-2] < 2.1
    assert times[-1] > 2.3
