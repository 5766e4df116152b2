"""`replay` of a run that was changed while it went on, by the installed script: what is repeated and told."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil.config import change_rig
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.values import ChangeData, Event, EventKind
from tests.helpers import bench
from tests.live.here import ChangedRun

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.recording.reexecute import Reexecution
    from tests.installed import Finished

    Script = Callable[..., Finished]

MU0, KP = "observer.mu0_rad_s", "controller.kp_1_s2"
SCRIPT: dict[int, Any] = {600: (f"{MU0}=70.7", f"{KP}=5000"), 800: (f"{MU0}=60",)}
_INCOMPLETE = 6


def recorded(path: Path, *events: Event) -> RecordedRun:
    """Record a run of 1 s with the changes of SCRIPT, and with further events."""
    rig = bench()
    sink = RecordingSink(path, rig.period, about(rig), rig_json(rig))
    for event in events:
        sink.event(event)
    ChangedRun(SCRIPT, duration=1.0, sinks=[sink]).run()
    return read_run(path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    run = recorded(tmp_path_factory.mktemp("whole") / "run.mcap")
    assert run.complete
    return run


@pytest.fixture(scope="module")
def damaged(whole: RecordedRun) -> RecordedRun:
    """The same recording, cut off after both changes."""
    path = whole.path.with_name("cut.mcap")
    content = whole.path.read_bytes()
    path.write_bytes(content[: int(0.9 * len(content))])
    run = read_run(path)
    assert run.damage
    assert len([event for event in run.events if event.kind is EventKind.CHANGE]) == len(SCRIPT)
    return run


def expected(run: RecordedRun, *overrides: str, without: str) -> list[list[str]]:
    """Return what a rig says to a run in which one key was never changed, as cells of a CSV file."""

    def left(event: Event) -> Event:
        if not isinstance(event.data, ChangeData):
            return event
        values = {key: value for key, value in event.data.values.items() if key != without}
        return event._replace(data=ChangeData(values))

    events = tuple(left(event) for event in run.events)
    again = reexecute(replace(run, events=events), change_rig(run.rig, overrides))
    assert again.unrepeated == ()
    return cells(again)


def cells(again: Reexecution) -> list[list[str]]:
    table = np.column_stack((again.estimate, again.demand))
    return [[repr(value) for value in row] for row in table.tolist()]


def columns(path: Path, ending: str) -> list[list[str]]:
    names = ("position_estimate_rad", "velocity_estimate_rad_s", "disturbance_estimate_rad_s2")
    with path.open(newline="", encoding="utf-8") as file:
        return [
            [row[f"{name}_{ending}"] for name in (*names, "voltage_demand_V")] for row in csv.DictReader(file)
        ]


@pytest.mark.parametrize("written", [("--set", f"{MU0}=90"), ("--mu0", "90"), ("--compare", "mu0 = 90")])
def test_a_key_that_an_option_names_stays_what_it_says(
    written: tuple[str, str], script: Script, whole: RecordedRun, tmp_path: Path
) -> None:
    done = script("replay", str(whole.path), *written, "--csv", "o.csv", "--json", "o.json")
    assert done.code == 0, done.err
    figures = json.loads((tmp_path / "o.json").read_text())
    compared = written[0] == "--compare"
    assert figures["identical"] is compared
    (variant,) = figures["compared"] if compared else (figures,)
    changes = variant["unrepeated_changes"]
    assert [(one["why"], one["values"]) for one in changes] == [
        ("pinned", {MU0: 70.7}),
        ("pinned", {MU0: 60.0}),
    ]
    assert 0.59 < changes[0]["t_s"] < 0.61
    assert columns(tmp_path / "o.csv", "compare1" if compared else "again") == expected(
        whole, f"{MU0}=90.0", without=MU0
    )
    label = f"{MU0}={'90.0' if written[0] == '--mu0' else '90'}"
    said = [line for line in done.err.splitlines() if not line.startswith("wrote ")]
    assert said == [
        f"{label}: 2 changes of {MU0} in the run are not repeated here, because the key was given."
    ]


def test_what_set_pins_is_pinned_in_every_variant(script: Script, whole: RecordedRun, tmp_path: Path) -> None:
    options = ("--set", f"{MU0}=90", "--compare", f"{KP}=3000", "--csv", "o.csv", "--json", "o.json")
    done = script("replay", str(whole.path), *options)
    assert done.code == 0, done.err
    (variant,) = json.loads((tmp_path / "o.json").read_text())["compared"]
    assert [one["values"] for one in variant["unrepeated_changes"]] == [{MU0: 70.7, KP: 5000.0}, {MU0: 60.0}]
    rig = change_rig(whole.rig, (f"{MU0}=90", f"{KP}=3000"))
    plain = reexecute(replace(whole, events=()), rig)
    assert columns(tmp_path / "o.csv", "compare1") == cells(plain)


def test_a_pinned_key_that_a_variant_lacks_is_not_left_out_because_it_was_given(
    script: Script, whole: RecordedRun, tmp_path: Path
) -> None:
    options = ("--set", f"{MU0}=90", "--compare", "observer=paper", "--json", "o.json")
    done = script("replay", str(whole.path), *options)
    assert done.code == 0, done.err
    (variant,) = json.loads((tmp_path / "o.json").read_text())["compared"]
    told = [(one["why"], one["reason"]) for one in variant["unrepeated_changes"] if MU0 in one["values"]]
    why = 'observer.kind = "paper" does not let it change in a run.'
    assert told == [("refused", why), ("refused", why)]
    said = [line for line in done.err.splitlines() if "observer.kind=paper: " in line]
    assert said
    assert not [line for line in said if "given" in line]


@pytest.mark.parametrize("state", ["whole", "damaged"])
def test_a_change_that_a_variant_cannot_take_is_told_and_the_rest_of_it_made(
    state: str, script: Script, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    run: RecordedRun = request.getfixturevalue(state)
    options = ("--compare", "observer=paper", "--csv", "o.csv", "--json", "o.json")
    done = script("replay", str(run.path), *options)
    assert done.code == (0 if run.complete else _INCOMPLETE), done.err
    (variant,) = json.loads((tmp_path / "o.json").read_text())["compared"]
    refused = variant["unrepeated_changes"]
    assert [(one["why"], one["values"]) for one in refused] == [
        ("refused", {MU0: 70.7}),
        ("refused", {MU0: 60.0}),
    ]
    warnings = [line for line in done.err.splitlines() if line.startswith("warning: observer.kind=paper: ")]
    assert len(warnings) == 1
    assert f"the change of {MU0} at 0.6" in warnings[0]
    assert "(and 1 later) is not repeated here" in warnings[0]
    assert 'observer.kind = "paper"' in warnings[0]
    wanted = expected(run, "observer.kind=paper", without=MU0)
    assert columns(tmp_path / "o.csv", "compare1") == wanted


def test_a_change_beyond_the_rules_of_a_variant_is_told_with_the_rule(
    script: Script, whole: RecordedRun, tmp_path: Path
) -> None:
    rough = ("controller.kd_1_s=30", f"{MU0}=200")  # chatters with the run's second kp, not with its first
    options = ("--compare", ";".join(rough), "--csv", "o.csv", "--json", "o.json")
    done = script("replay", str(whole.path), *options)
    assert done.code == 0, done.err
    (variant,) = json.loads((tmp_path / "o.json").read_text())["compared"]
    refused = [one for one in variant["unrepeated_changes"] if one["why"] == "refused"]
    assert [one["values"] for one in refused] == [{KP: 5000.0}]
    assert refused[0]["reason"].startswith(f"{KP}: got 5000; with these gains")
    assert f"warning: {'; '.join(rough)}: the change of {KP} at 0.6" in done.err
    plain = reexecute(replace(whole, events=()), change_rig(whole.rig, rough))
    assert columns(tmp_path / "o.csv", "compare1") == cells(plain)


@pytest.mark.parametrize("cut", [False, True])
def test_a_change_that_the_run_itself_cannot_have_taken_makes_the_repetition_incomplete(
    cut: bool, script: Script, tmp_path: Path
) -> None:
    change = ChangeData({"observer.bogus": 1.0})
    run = recorded(tmp_path / "run.mcap", Event(0.25, "INFO", EventKind.CHANGE, "", change))
    if cut:
        content = run.path.read_bytes()
        run.path.write_bytes(content[: int(0.9 * len(content))])
    done = script("replay", "run.mcap", "--json", "o.json", "--csv", "o.csv")
    assert done.code == _INCOMPLETE
    figures = json.loads((tmp_path / "o.json").read_text())
    assert figures["identical"]  # nothing of the run depended on it
    assert figures["unrepeated_changes"] == [
        {
            "t_s": 0.25,
            "values": {"observer.bogus": 1.0},
            "why": "refused",
            "reason": 'observer.kind = "super_twisting" does not let it change in a run.',
        }
    ]
    assert "warning: run.mcap: the change of observer.bogus at 0.250 s is not repeated here" in done.err
    assert len([line for line in done.err.splitlines() if line.startswith("error: ")]) == 1
    assert (tmp_path / "o.csv").exists()
