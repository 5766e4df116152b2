"""What is tuned in a run: a table that changes, and a step in a line, for every event of a change."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil import load_rig
from dcmp_hil.live.tunables import changed
from dcmp_hil.telemetry.rerun.parameter_table import Parameters, page_of, table_of
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.values import ChangeData, Event, EventKind
from tests.telemetry.runs import blocks, periods_of, read_back

if TYPE_CHECKING:
    from pathlib import Path

RIG = load_rig("bench-1khz")


def change(*overrides: str, t: float = 0.5) -> Event:
    """Return the event of a change as the loop tells of it."""
    _, made = changed(RIG, overrides)
    return Event(t, "INFO", EventKind.CHANGE, "in words", ChangeData(made.values))


def parameters() -> Parameters:
    view = view_of(RIG)
    return Parameters(view.parameters, view.kinds, view.numbers)


def test_a_change_is_in_the_table_and_over_what_it_was_at_the_start() -> None:
    found = parameters()
    assert set(found.relative) == {1.0}
    assert found.take(change("controller.kp_1_s2=5000", "observer.mu0_rad_s=60")) == {
        "controller.kp_1_s2": 5000.0,
        "observer.mu0_rad_s": 60.0,  # it was by rule
    }
    relative = dict(zip(found.drawn, found.relative, strict=True))
    assert relative["controller.kp_1_s2"] == 1.25
    assert relative["observer.mu0_rad_s"] == 1.5
    assert relative["controller.kd_1_s"] == 1.0
    assert found.rows["controller.kp_1_s2"] == "5000"
    assert "reference.phase_rad" not in found.drawn  # it was 0: nothing is so many times that


@pytest.mark.parametrize("text", ["lowering the arm", "loop.rate_hz: 500 -> 1000", ""])
def test_other_events_change_nothing(text: str) -> None:
    found = parameters()
    assert found.take(Event(0.5, "INFO", EventKind.OTHER, text)) is None
    assert found.rows == parameters().rows


def test_another_kind_of_reference_has_keys_of_its_own() -> None:
    found = parameters()
    told = found.take(change("reference.kind=step", "reference.at_s=3", "reference.after_rad=0.4"))
    assert told is not None
    assert told["reference.at_s"] == 3.0
    assert found.rows["reference.kind"] == "step"
    assert "reference.rate_rad_s" not in found.rows
    assert found.rows["reference.soft_start_s"] == "2"  # both have it
    assert math.isnan(dict(zip(found.drawn, found.relative, strict=True))["reference.rate_rad_s"])
    assert found.rows["controller.kp_1_s2"] == "4000"


def test_a_recording_explains_itself(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    sink = RerunSink(view_of(RIG), record, "none")
    first, second = blocks(1000, rows=500)
    sink.block(first)
    sink.event(change("controller.kp_1_s2=5000"))
    sink.block(second)
    sink.close()
    pages: list[Any] = read_back(record, "params")["TextDocument:text"]
    table = r"| **controller** |  |\n| kind | pd_compensated |\n| kp_1_s2 | 4000 |"
    assert [table in str(page) for page in pages] == [True, False]
    assert "| kp_1_s2 | 5000 |" in str(pages[1])
    line = read_back(record, "params/controller/kp_1_s2")
    assert (periods_of(line), line["Scalars:scalars"]) == ([0, 500], [[4000.0], [5000.0]])
    place = parameters().drawn.index("controller.kp_1_s2")
    relative: Any = read_back(record, "params_over_start")
    steps = [row[place] for row in relative["Scalars:scalars"]]
    assert (periods_of(relative), steps) == ([0, 500, 999], [1.0, 1.25, 1.25])


def test_no_value_ends_its_cell_or_begins_markup() -> None:
    rows = {"reference.file": "a|b*.csv", "controller._own_": "<b>\n# x"}
    assert page_of("ri|g", rows).splitlines() == [
        *(r"| ri\|g | |", "|:--|:--|", "| **reference** |  |", r"| file | a\|b\*.csv |"),
        *("| **controller** |  |", r"| \_own\_ | \<b> # x |"),
    ]
    assert table_of("versions", [("host", "a|b")]).splitlines()[-1] == r"| host | a\|b |"
