"""Marks of a trip, a warning and a change, and the layout and the end of a run that has tripped."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rerun as rr
from rerun.components import AggregationPolicy

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.rerun.marks import MARKS, Marks, mark_of
from dcmp_hil.telemetry.rerun.plots import plots
from dcmp_hil.telemetry.rerun.rails import reach_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.values import CauseData, ChangeData, EndData, Event, EventKind, LimitData, LinkData, PhaseData
from tests.telemetry.runs import VIEW, blocks, chunks, entities, read_back, values

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from dcmp_hil.telemetry.block import Block

CHANGE = Event(1.25, "INFO", EventKind.CHANGE, "in words", ChangeData({"controller.kp_1_s2": 4500.0}))
WARNING = Event(1.75, "WARN", EventKind.LIMIT, "11.0 V asked for", LimitData("voltage"))
PHASE = Event(1.999, "INFO", EventKind.PHASE, "tripped", PhaseData("tripped"))
TRIP = Event(1.999, "ERROR", EventKind.TRIP, "tripped (travel): 6.3 rad. Check it.", CauseData("travel"))


@pytest.fixture(autouse=True)
def _strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def tripped_run(path: Path, made: list[Block]) -> None:
    """Write a run of 2 s with a change and a warning, which ends by a trip in its last cycle."""
    sink = RerunSink(VIEW, path, "none")
    events = [CHANGE, WARNING, PHASE]
    sink.event(Event(0.0, "INFO", EventKind.PHASE, "running", PhaseData("running")))
    for block in made:
        while events and events[0].t <= block["t"][-1]:
            sink.event(events.pop(0))
        sink.block(block)
    sink.event(TRIP)
    sink.event(Event(1.999, "INFO", EventKind.END, "amplifier at 0 V"))
    sink.close()


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tripped") / "run.rrd"
    made = blocks(2000)
    made[-1].rows[-1, FIELDS.index("position_estimate")] = 77.0  # as an estimate may be in the last cycle
    tripped_run(path, made)
    return path


@pytest.mark.parametrize(
    ("event", "kind"),
    [
        *((CHANGE, "change"), (WARNING, "warning"), (PHASE, "trip"), (TRIP, "trip")),
        (Event(1.0, "ERROR", EventKind.DEADLINE, "too late", CauseData("deadline")), "trip"),
        (Event(1.0, "WARN", EventKind.DEVICE_END, "the device ended the run"), "warning"),
        (Event(1.0, "INFO", EventKind.END, "amplifier at 0 V", EndData("OSError", "No file.")), "trip"),
        (Event(1.0, "ERROR", EventKind.END, "0 V was not confirmed"), "trip"),
        (Event(1.0, "INFO", EventKind.END, "amplifier at 0 V"), None),
        (Event(1.0, "INFO", EventKind.PHASE, "tripped", PhaseData("running")), None),
        (Event(1.0, "DEBUG", EventKind.LINK, "tripped", LinkData({"lost": 3})), None),
    ],
)
def test_events_that_have_a_mark(event: Event, kind: str | None) -> None:
    assert mark_of(event) == kind


@pytest.mark.parametrize(("kind", "at"), [("change", 1.25), ("warning", 1.75), ("trip", 1.999)])
def test_a_mark_is_in_every_plot_at_its_instant_and_as_high_as_the_axis(
    record: Path, kind: str, at: float
) -> None:
    for plot in plots():
        table: dict[str, list[Any]] = read_back(record, f"{plot.path}/marks/{kind}")
        assert table["SeriesLines:names"] == [[kind]]
        assert table["SeriesLines:aggregation_policy"] == [[AggregationPolicy.Off.value]]
        times = np.array([time.total_seconds() for time in table["loop_time"]])
        assert times == pytest.approx(np.full(len(times), at), abs=1e-6)
        heights = np.array(table["Scalars:scalars"]).reshape(-1, 3)
        assert np.isnan(heights[:, 2]).all()
        assert (heights[:, 0] == -heights[:, 1]).all()
        rails = values(record, f"{plot.path}/rails")
        assert heights[:, 1].max() == pytest.approx(rails.max())


def test_errors_and_estimates_end_with_the_trip_and_other_lines_do_not(record: Path) -> None:
    for plot in plots():
        last = values(record, f"{plot.path}/lines")[-1]
        assert np.isnan(last).all() == plot.frozen
        assert not np.isnan(values(record, f"{plot.path}/lines")[-2]).any()
    assert values(record, "errors/position_mrad/rails").max() < 77e3


def test_the_picture_goes_on_for_a_second_behind_a_trip(record: Path, tmp_path: Path) -> None:
    phase: dict[str, list[Any]] = read_back(record, "phase")
    assert phase["StateChange:state"] == [["running"], ["tripped"], ["tripped"]]
    assert [time.total_seconds() for time in phase["loop_time"]] == pytest.approx([0.0, 1.999, 2.999])
    sink = RerunSink(VIEW, tmp_path / "whole.rrd", "none")
    sink.event(Event(0.0, "INFO", EventKind.PHASE, "running", PhaseData("running")))
    for block in blocks(500):
        sink.block(block)
    sink.close()
    assert len(read_back(tmp_path / "whole.rrd", "phase")["loop_time"]) == 1
    assert not [entity for entity in entities(tmp_path / "whole.rrd") if "/marks/" in entity]


def test_the_layout_of_a_trip_is_sent_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[object] = []
    original = rr.RecordingStream.send_blueprint

    def noted(stream: rr.RecordingStream, layout: Any, **options: bool) -> None:
        sent.append(layout)
        original(stream, layout, **options)

    monkeypatch.setattr(rr.RecordingStream, "send_blueprint", noted)
    tripped_run(tmp_path / "run.rrd", blocks(2000))
    assert len(sent) == 2  # as the recording begins, and at the trip


def test_a_mark_waits_for_its_axis_and_grows_with_it() -> None:
    marks = Marks()
    marks.add("change", 2.0)
    assert list(marks.due("a", 1.9, 1.05)) == []
    assert list(marks.due("a", 2.1, 1.05)) == [("change", 2.0, 1.05)]
    assert list(marks.due("a", 2.2, 1.05)) == []
    assert list(marks.due("b", 2.2, 10.5)) == [("change", 2.0, 10.5)]
    assert list(marks.due("a", 2.3, 1.5)) == [("change", 2.0, 1.5)]
    marks.add("trip", 2.4)
    assert list(marks.due("a", 2.4, 1.05)) == [("trip", 2.4, 1.5)]  # the older one holds the axis
    marks.forget(7.1)
    assert list(marks.due("a", 7.1, 100.0)) == [("trip", 2.4, 100.0)]


def test_a_trip_of_a_cycle_that_was_not_recorded_has_its_mark_all_the_same(tmp_path: Path) -> None:
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    for block in blocks(500):
        sink.block(block)
    sink.event(TRIP)
    sink.close()
    for plot in plots():
        times: list[Any] = read_back(tmp_path / "run.rrd", f"{plot.path}/marks/trip")["loop_time"]
        assert [round(time.total_seconds(), 3) for time in times] == [1.999] * 3


def test_a_limit_that_acts_again_and_again_has_two_marks_a_second() -> None:
    marks = Marks()
    for k in range(1000):
        marks.add("warning", 1e-3 * k)
    assert len(list(marks.due("a", 1.0, 1.05))) == 2


def test_a_demand_far_beyond_the_limit_is_drawn_a_little_beyond_it(tmp_path: Path) -> None:
    made = blocks(1000)
    made[5].rows[50, FIELDS.index("voltage_demand")] = -2626.0
    made[0].rows[:, FIELDS.index("began")] = 0.05
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    for block in made:
        sink.block(block)
    sink.close()
    demanded = values(tmp_path / "run.rrd", "control/voltage_V/lines")[:, 0]
    assert demanded[550] == -12.0
    assert np.isnan(demanded[:50]).all()  # nothing is asked for before the trajectory begins
    assert not np.isnan(demanded[50:]).any()
    assert values(tmp_path / "run.rrd", "control/voltage_V/rails").max() == pytest.approx(reach_of(12.0))


def test_colours_of_marks_differ_from_one_another() -> None:
    colours = np.array([mark.colour for mark in MARKS.values()])
    apart = np.abs(colours[:, None] - colours).sum(axis=-1) + 1000 * np.eye(len(colours))
    assert apart.min() > 100


def test_a_minute_of_a_file_has_few_chunks(tmp_path: Path) -> None:
    """A chunk costs 1.6 kB beside its numbers."""
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    for block in blocks(10_000):
        sink.block(block)
    sink.close()
    assert sum(1 for _ in chunks(tmp_path / "run.rrd")) < 500
