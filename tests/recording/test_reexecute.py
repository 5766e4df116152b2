"""A run's recording handed to observer and controller again, and written for others."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.ipc.mailbox import APPLIED
from dcmp_hil.recording.compare import compare
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.recorded_changes import changes_in
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.values import ChangeData, Event, EventKind
from tests.helpers import bench, named
from tests.live.here import ChangedRun
from tests.telemetry.runs import values

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.control import controllers
    from dcmp_hil.values import Estimate, Reference
    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]

BOARD = "backend.kind=sim-board"


def record(folder: Path, *overrides: str, duration: float = 3.0) -> Path:
    rig = bench(*overrides)
    sink = RecordingSink(folder / "run.mcap", rig.period, about(rig), rig_json(rig))
    run(rig, duration=duration, fast=True, sinks=[sink])
    return folder


@pytest.mark.parametrize(
    "overrides",
    [
        (),
        ("observer.kind=paper",),
        ("controller.friction_feedforward=true", "run.end=lower"),
        ("controller.kind=pd", "controller.position=measured", "loop.delay_samples=0"),
        ("encoder.counts_per_rev=ideal", "loop.rate_hz=2000"),
        ("supervisor.start=immediate", "reference.kind=step"),
        (BOARD, "backend.carrier=slcan"),
    ],
    ids=" ".join,
)
def test_the_same_gains_give_the_same_numbers_to_the_bit(tmp_path: Path, overrides: tuple[str, ...]) -> None:
    recorded = read_run(record(tmp_path, *overrides))
    result = compare(recorded, reexecute(recorded))
    assert result.identical
    assert result.rows == len(recorded.rows) > 2000
    assert {line.again for line in result.figures if "difference" in line.name} == {0.0}


def test_lost_samples_are_lost_again(tmp_path: Path, cli: Cli) -> None:
    fault = ("--fault", "wire.drop:p=0.05,at=1s")
    assert cli("run", "--fast", "--duration", "3", "--set", BOARD, *fault).code == 0
    (folder,) = (tmp_path / "runs").iterdir()
    recorded = read_run(folder)
    assert len(recorded.rows) < 2950
    assert compare(recorded, reexecute(recorded)).identical
    assert json.loads(recorded.run["faults"]) == [fault[1]]


@pytest.mark.parametrize(
    "script",
    [
        {1500: ("controller.kp_1_s2=5200.123456789", "controller.kd_1_s=150")},
        {
            1500: ("observer.mu0_rad_s=70.7",),
            1600: ("controller.kind=pd",),
            2200: ("controller.kind=pd_compensated",),
        },
        {1500: ("reference.rate_rad_s=1.25",), 2100: ("reference.kind=hold", "reference.position_rad=0.3")},
        {1500: ("reference.offset_rad=-0.2", "observer.L1_1_s=6.1", "controller.kp_1_s2=3000")},
    ],
)
@pytest.mark.parametrize("friction", ["true", "false"])
def test_changes_made_in_a_run_are_made_again(tmp_path: Path, script: dict[int, Any], friction: str) -> None:
    overrides = (f"controller.friction_feedforward={friction}",)
    rig = bench(*overrides)
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    changed = ChangedRun(script, *overrides, duration=4.0, sinks=[sink])
    changed.run()
    assert {answer.what for answer in changed.answers if answer} == {APPLIED}
    recorded = read_run(tmp_path)
    assert len(changes_in(recorded.events, recorded.rig).made) == len(script)
    assert compare(recorded, reexecute(recorded)).identical
    told = friction == "true" or any(
        not key.startswith("reference") for keys in script.values() for key in keys
    )
    assert compare(recorded, reexecute(replace(recorded, events=()))).identical != told  # references are rows


def test_one_bit_of_difference_is_one(tmp_path: Path) -> None:
    recorded = read_run(record(tmp_path, duration=1.0))
    recorded.rows[500, 1] = np.nextafter(recorded.rows[500, 1], 9.0)
    assert not compare(recorded, reexecute(recorded)).identical


class Mine:
    """A user's own controller."""

    def __init__(self, setting: controllers.ControllerContext, gain: float = 100.0) -> None:
        self._gain = gain * 5.4 / setting.model.ku

    def update(self, reference: Reference, state: Estimate) -> float:
        return self._gain * (reference.position - state.position) - 2.0 * state.velocity


def test_a_controller_of_one_s_own_runs_again(tmp_path: Path) -> None:
    own = (f"controller.kind={named(Mine)}", "controller.options={gain = 60.0}")
    recorded = read_run(record(tmp_path, *own))
    assert compare(recorded, reexecute(recorded, trust=True)).identical


# ------------------------------------------------------------------------------------------ command line


def test_replay_says_to_the_bit_and_compares_other_gains(tmp_path: Path, cli: Cli) -> None:
    folder = str(record(tmp_path))
    assert "every number is the same, to the bit" in cli("replay", folder).out.replace("\n", " ")
    file = tmp_path / "figures.json"
    outcome = cli("replay", folder, "--set", "observer.mu0_rad_s=90", "--json", str(file))
    assert "the numbers differ" in outcome.out.replace("\n", " ")
    figures = json.loads(file.read_text())
    assert figures["identical"] is False
    velocity = figures["velocity_error_rms_rad_s"]
    assert velocity["again"] > 1.2 * velocity["recorded"]  # faster is noisier
    assert figures["demand_difference_max_V"]["again"] > 0.1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--set", "loop.rate_hz=500"), "what was measured stays as it was"),
        (("--set", "observer.mu=5"), "unknown key"),
        (("--set", "controller.kp_1_s2=-1"), "controller.kp_1_s2"),
    ],
)
def test_what_cannot_be_changed_afterwards_is_refused(
    tmp_path: Path, cli: Cli, arguments: tuple[str, ...], says: str
) -> None:
    outcome = cli("replay", str(record(tmp_path, duration=1.0)), *arguments)
    assert outcome.code == 2
    assert says in outcome.err.replace("\n", " ")


def test_a_recording_that_was_cut_off_is_replayed_and_said_to_be(tmp_path: Path, cli: Cli) -> None:
    path = record(tmp_path, duration=2.0) / "run.mcap"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    outcome = cli("replay", str(path))
    assert outcome.code == 6
    assert "what came later is missing, device time" in outcome.err
    assert "to the bit" in outcome.out.replace("\n", " ")


GAINS = {
    ("--observer", "paper"): "observer.kind=paper",
    ("--observer", "Super-Twisting"): "observer.kind=super_twisting",
    ("--mu0", "70"): "observer.mu0_rad_s=70.0",
    ("--M", "40"): "observer.M_rad_s3=40.0",
    ("--L1", "6"): "observer.L1_1_s=6.0",
    ("--L2", "8"): "observer.L2_1_s2=8.0",
    ("--f0", "0.5"): "model.f0_1_s=0.5",
    ("--ku", "4"): "model.ku_rad_s2_V=4.0",
}


def test_every_gain_is_honoured_under_its_short_name(tmp_path: Path, cli: Cli) -> None:
    folder = str(record(tmp_path, duration=1.0))

    def figures(*options: str) -> dict[str, Any]:
        outcome = cli("replay", folder, *options, "--json", "-")
        assert (outcome.code, outcome.err) == (0, "")
        got: dict[str, Any] = json.loads(outcome.out)
        return got

    usual = figures()
    for short, key in GAINS.items():
        assert figures(*short) == figures("--set", key)
        assert figures(*short)["identical"] == (short[1] == "Super-Twisting")
        assert (figures(*short) == usual) == (short[1] == "Super-Twisting")


def test_window_and_files_of_a_run_are_honoured(tmp_path: Path, cli: Cli) -> None:
    folder = str(record(tmp_path, duration=2.0))
    csv_file, rrd = tmp_path / "o.csv", tmp_path / "o.rrd"
    outcome = cli(
        *("replay", folder, "--mu0", "70", "--from", "1.5", "--json", "-", "--csv", str(csv_file)),
        *("--rrd", str(rrd), "--no-write"),
    )
    figures = json.loads(outcome.out)
    assert (figures["rows"], figures["identical"]) == (500, False)
    with csv_file.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2000
    now, then = (
        np.array([float(row[f"velocity_estimate_rad_s{end}"]) for row in rows]) for end in ("_again", "")
    )
    assert np.max(np.abs(now - then)[1500:]) == figures["velocity_difference_max_rad_s"]["again"]
    assert np.array_equal(values(rrd, "velocity_estimate_rad_s")[:, 1], now)


@pytest.mark.parametrize(
    "option",
    [
        *(("--time", "t"), ("--position", "q"), ("--voltage", "none"), ("--velocity-unit", "rpm")),
        *(("--period", "0.002"), ("--no-input",), ("--modulus", "65536"), ("--input-at", "end")),
        *(("--rig", "paper"), ("--inertia", "0.1"), ("--counts-per-rev", "2000"), ("--cutoff", "15")),
    ],
)
def test_an_option_that_means_nothing_for_a_run_is_refused(
    option: tuple[str, ...], tmp_path: Path, cli: Cli
) -> None:
    outcome = cli("replay", str(tmp_path), *option)
    assert (outcome.code, outcome.out) == (2, "")
    assert f"{option[0]}: for a CSV file only" in outcome.err


def test_one_key_given_twice_is_refused(tmp_path: Path, cli: Cli) -> None:
    folder = str(record(tmp_path, duration=0.5))
    outcome = cli("replay", folder, "--mu0", "70", "--set", "observer.mu0_rad_s=60")
    assert outcome.code == 2
    assert "--mu0 and --set observer.mu0_rad_s say the same" in outcome.err


def test_exports_are_the_recording(tmp_path: Path, cli: Cli) -> None:
    folder = record(tmp_path, duration=2.0)
    made = {kind: tmp_path / f"out.{kind}" for kind in ("csv", "parquet", "rrd")}
    options = [word for kind, path in made.items() for word in (f"--{kind}", str(path))]
    assert cli("export", str(folder), *options).code == 0
    table = read_run(folder).columns
    with made["csv"].open(newline="") as file:
        rows = list(csv.DictReader(file))
    for name, column in table.items():
        read = np.array([float(row[name] or "nan") for row in rows])
        assert read.tobytes() == column.tobytes() or np.array_equal(read, column, equal_nan=True), name
    from pyarrow import parquet  # type: ignore[import-untyped]

    read_back = parquet.read_table(made["parquet"])
    assert read_back.column_names == list(table)
    assert np.array_equal(read_back["velocity_estimate_rad_s"].to_numpy(), table["velocity_estimate_rad_s"])
    assert read_back.schema.metadata[b"rig"] == b"bench-1khz"
    assert np.array_equal(values(made["rrd"], "joint/position_rad")[:, 0], table["position_rad"])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((), "Nothing to write"),
        (("--csv", "run.mcap"), "is the recording itself"),
        (("--csv", "no/where"), "may write"),
    ],
)
def test_exports_that_cannot_be_are_refused(
    tmp_path: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], says: str
) -> None:
    record(tmp_path, duration=0.5)
    monkeypatch.chdir(tmp_path)
    outcome = cli("export", "run.mcap", *arguments)
    assert outcome.code == 2
    assert says in outcome.err.replace("\n", " ")


def test_a_run_keeps_its_recording_unless_told_not_to(tmp_path: Path, cli: Cli) -> None:
    assert cli("run", "--fast", "--duration", "1", "--note", "warm motor").code == 0
    (folder,) = (tmp_path / "runs").iterdir()
    read = read_run(folder)
    assert (len(read.rows), read.run["note"], read.complete) == (1000, "warm motor", True)
    assert read.events[-1].text == "amplifier at 0 V"


def test_a_change_is_repeated_without_the_file_of_the_reference(tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    file.write_text("time_s,position_rad\n0,0\n1,0.5\n")
    rig = bench("reference.kind=csv", f"reference.file={file}")
    rig = rig.model_copy(update={"reference": rig.reference.model_copy(update={"file": "/never/there.csv"})})
    event = Event(0.5, "INFO", EventKind.CHANGE, "", ChangeData({"controller.kp_1_s2": 5000.0}))
    ((t, change),) = changes_in([event], rig).made
    assert (t, change.variation) == (0.5, None)
    assert change.gains is not None
