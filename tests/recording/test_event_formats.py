"""Events: programs read kind and data, never the sentence; recordings of format 1 are read and replayed."""

from __future__ import annotations

import ast
import json
import math
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import rerun as rr
from rich.console import Console

import dcmp_hil
import sim_backend
from dcmp_hil import load_rig
from dcmp_hil.cli.status_line import StatusLine
from dcmp_hil.recording.compare import compare
from dcmp_hil.recording.format_1 import event_of_format_1
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.recorded_changes import changes_in
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.schema import event_from, event_to_bytes
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.telemetry.rerun.entity_columns import Frames
from dcmp_hil.telemetry.rerun.parameter_table import Parameters
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.values import (
    DATA,
    CauseData,
    ChangeData,
    EndData,
    Event,
    EventKind,
    LimitData,
    LinkData,
    PhaseData,
    ProbeData,
)
from tests.helpers import bench
from tests.live.here import ChangedRun

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.telemetry.rerun.entity_columns import Call
    from dcmp_hil.values import EventData

OLD = Path(__file__).with_name("data") / "format_1.mcap"  # 200 Hz, four changes, lowered at the end
SCRIPT = {
    1500: ("controller.kp_1_s2=5200.123456789", "controller.kd_1_s=150"),
    1800: ("observer.mu0_rad_s=70.7", "reference.offset_rad=-0.1"),
    2100: ("reference.kind=hold", "reference.position_rad=0.3"),
    2300: ("controller.kind=pd",),
}
EXAMPLES: dict[type[EventData], EventData] = {
    PhaseData: PhaseData("running"),
    ProbeData: ProbeData(5.4, 0.1, 1.0000000000000002),
    LimitData: LimitData("slew"),
    LinkData: LinkData({"lost": 3, "late": 0}),
    ChangeData: ChangeData({"controller.kp_1_s2": 0.1 + 0.2, "controller.kind": "pd"}),
    CauseData: CauseData("speed"),
    EndData: EndData("LinkError", "The cable is out."),
}


def scrambled(events: Iterable[Event]) -> tuple[Event, ...]:
    """Reword every sentence so that it says something else, or what another one said before."""
    words = [
        "lowering the arm",
        "controller.kp_1_s2: 1 -> 2, applied at t = 0.500 s",
        "running",
        "lost=9",
        "",
    ]
    return tuple(event._replace(text=words[k % len(words)]) for k, event in enumerate(events))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    overrides = ("controller.friction_feedforward=true", "run.end=lower")
    rig, path = bench(*overrides), tmp_path_factory.mktemp("run") / "run.mcap"
    sink = RecordingSink(path, rig.period, about(rig), rig_json(rig))
    ChangedRun(SCRIPT, *overrides, duration=3.0, sinks=[sink]).run()
    return read_run(path)


# ------------------------------------------------------------------------------------------ no sentence read


def test_rewording_every_sentence_changes_no_replay(recorded: RecordedRun) -> None:
    reworded = replace(recorded, events=scrambled(recorded.events))
    assert len(changes_in(reworded.events, reworded.rig).made) == len(SCRIPT)
    assert compare(recorded, reexecute(reworded)).identical
    for kind in (EventKind.CHANGE, EventKind.LOWERING):  # and each of the two is needed for it
        without = tuple(event for event in recorded.events if event.kind is not kind)
        assert not compare(recorded, reexecute(replace(recorded, events=without))).identical


def test_rewording_every_sentence_changes_nothing_of_the_dashboard_but_its_words(
    recorded: RecordedRun,
) -> None:
    view = view_of(recorded.rig)
    events = (*recorded.events, Event(1.0, "DEBUG", EventKind.LINK, "lost=3", LinkData({"lost": 3})))
    one, other = Frames(view), Frames(view)
    params = Parameters(view.parameters, view.kinds, view.numbers)
    more = Parameters(view.parameters, view.kinds, view.numbers)
    for event, reworded in zip(events, scrambled(events), strict=True):
        assert _sent(one.of_event(event)) == _sent(other.of_event(reworded))
        assert params.take(event) == more.take(reworded)
    assert params.rows == more.rows
    assert params.relative == pytest.approx(more.relative, nan_ok=True)


def _sent(calls: list[Call]) -> list[str]:
    """Return what Rerun is sent but the words for people, as text: it has NaN in it."""
    return [
        f"{entity} {[str(time.as_arrow_array()) for time in times]} "
        f"{[str(column.as_arrow_array()) for column in columns]}"
        for entity, times, columns in calls
        if entity not in {"events/log", "events/last", "banner"} and not isinstance(columns, rr.SeriesLines)
    ]


def test_phase_of_the_status_line_is_no_sentence() -> None:
    line = StatusLine(Console(file=StringIO()), 1e-3)
    line.event(Event(0.0, "INFO", EventKind.PHASE, "all is well", PhaseData("running")))
    assert line._phase == "running"  # noqa: SLF001


def test_no_program_reads_a_sentence() -> None:
    """Sentences go to people and to files for them; no program compares or parses them."""
    shown = {
        "banner.py",
        "entity_columns.py",
        "feed.py",
        "summary_sink.py",
        "status_line.py",
        "schema.py",
        "telemetry_process.py",
    }
    for package in (dcmp_hil, sim_backend):
        for path in Path(package.__path__[0]).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Compare | ast.Call | ast.Match):
                    parts = [node.func] if isinstance(node, ast.Call) else list(ast.iter_child_nodes(node))
                    read = any("event.text" in ast.unparse(part) for part in parts)
                    assert not read, f"{path}:{getattr(node, 'lineno', 0)}"
                if isinstance(node, ast.Attribute) and ast.unparse(node) == "event.text":
                    assert path.name in shown, path


# -------------------------------------------------------------------------------------------------- formats


@pytest.mark.parametrize("kind", EventKind)
def test_every_kind_comes_back_to_the_bit(kind: EventKind) -> None:
    data = EXAMPLES[DATA[kind]] if kind in DATA else None
    for t in (0.1 + 0.2, math.inf):
        event = Event(t, "WARN", kind, "something, for people", data)
        read = event_from(json.loads(event_to_bytes(event, 5)))
        assert read == event
        assert type(read.data) is type(data)


def test_an_end_without_data_is_one_as_it_was_asked_for() -> None:
    event = Event(1.0, "INFO", EventKind.END, "amplifier at 0 V")
    assert event_from(json.loads(event_to_bytes(event, 5))) == event


def test_a_kind_of_a_later_version_is_read_as_another() -> None:
    event = event_from({"t": 1.0, "level": 2, "name": "teleported", "message": "!", "data": {"far": 3}})
    assert event == Event(1.0, "INFO", EventKind.OTHER, "!")


@pytest.mark.parametrize(
    "document",
    [
        {},
        {"t": 1.0, "level": 2, "name": "phase", "message": "running", "data": None},
        {"t": 1.0, "level": 2, "name": "phase", "message": "running", "data": {"phase": [1]}},
        {"t": 1.0, "level": 2, "name": "change", "message": "x", "data": {"values": {"a.b": [1]}}},
        {"t": "soon", "level": 2, "name": "other", "message": "x", "data": None},
        {"t": 1.0, "level": [], "name": {}, "message": "x", "data": None},
    ],
    ids=str,
)
def test_an_event_that_is_none_is_refused(document: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="cannot read"):
        event_from(document)
    with pytest.raises(ValueError, match="cannot read"):
        event_of_format_1(document)


def test_a_recording_of_format_1_is_read() -> None:
    run = read_run(OLD)
    assert run.run["format"] == "1"
    assert (run.damage, len(run.unchecked), run.complete) == ((), 1, False)
    phases = [event.data.phase for event in run.events if isinstance(event.data, PhaseData)]
    assert phases == ["probing", "settling", "engaging", "running"]
    changes = [dict(event.data.values) for event in run.events if isinstance(event.data, ChangeData)]
    assert changes == [
        {"controller.kp_1_s2": 910.123456789, "controller.kd_1_s": 42},
        {"observer.mu0_rad_s": 21.7, "reference.offset_rad": -0.05},
        {"reference.kind": "hold", "reference.position_rad": 0.1},
        {"controller.kind": "pd"},
    ]
    links = [event.data.counters for event in run.events if isinstance(event.data, LinkData)]
    assert [len(counters) for counters in links] == [7, 12]
    assert (links[1]["lost"], links[1]["sequence_gaps"]) == (3, 4)
    assert [event.t for event in run.events if event.kind is EventKind.LOWERING] == [1.995]


def test_a_recording_of_format_1_is_replayed_to_the_bit() -> None:
    run = read_run(OLD)
    assert compare(run, reexecute(run)).identical
    for kind in (EventKind.CHANGE, EventKind.LOWERING):
        without = tuple(event for event in run.events if event.kind is not kind)
        assert not compare(run, reexecute(replace(run, events=without))).identical


def test_an_event_that_is_none_is_left_out_and_told(tmp_path: Path) -> None:
    rig = load_rig("bench-1khz")
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    sink.event(Event(0.0, "INFO", EventKind.PHASE, "no data"))
    sink.close()
    read = read_run(tmp_path)
    assert read.events == ()
    assert "1 events cannot be read" in read.damage
