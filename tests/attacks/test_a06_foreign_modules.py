"""A6. Who attacks: the author of a recording that a colleague replays or exports.

What is promised: nothing that the rig in a recording names is imported, looked for, or opened, unless --trust
says so; the class is named. `run` of a rig file does import what it names: a rig file is a program.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import run
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.writer import RecordingSink
from tests.helpers import bench
from tests.installed import environment

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

    Script = Callable[..., Finished]

_EVIL = """
from pathlib import Path
Path("was_here").write_text("gotcha")
class Mine:
    def __init__(self, context):
        pass
    def update(self, reference, state):
        return 0.0
"""
_WATCHED = """
import sys
def told(event, arguments):
    if event in {"open", "import", "os.listdir", "os.scandir"} and "evil" in str(arguments[:1]):
        print("TOUCHED", event, arguments[:1], file=sys.__stdout__, flush=True)
sys.addaudithook(told)
sys.argv[0] = "dcmp-hil"
from dcmp_hil.cli import main
main()
"""


@pytest.fixture(params=["controller", "observer", "backend", "reference"])
def foreign(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, Path]:
    """Return what a recording names, and its folder; what it names lies there, and in the current folder."""
    rig = bench("supervisor.start=immediate")
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), _naming(request.param))
    run(rig, duration=0.3, fast=True, sinks=[sink])
    (tmp_path / "evil_mine.py").write_text(_EVIL)
    (tmp_path / "evil.csv").write_text("time_s,position_rad\n0,0\n1,1\n")
    return request.param, tmp_path


def _naming(section: str) -> str:
    """Return a rig as JSON that names something; it need not be there."""
    table = json.loads(rig_json(bench("controller.friction_feedforward=true", "supervisor.start=immediate")))
    if section == "reference":
        table["reference"] = {"kind": "csv", "file": "evil.csv"}
    else:
        table[section] = {"kind": "evil_mine:Mine"}
    return json.dumps(table)


def test_neither_replay_nor_export_touches_what_a_recording_names(foreign: tuple[str, Path]) -> None:
    section, folder = foreign
    for command in (
        ("replay", "run.mcap"),
        ("export", "run.mcap", "--csv", "out.csv", "--parquet", "out.pq"),
    ):
        done = subprocess.run(
            [sys.executable, "-c", _WATCHED, *command],
            cwd=folder, env=environment(), check=False, capture_output=True, text=True, timeout=240,
        )  # fmt: skip
        assert "TOUCHED" not in done.stdout, done.stdout
        assert "Traceback" not in done.stderr
        assert not (folder / "was_here").exists()
        if command[0] == "export" or section == "backend":  # a replay has no backend
            assert done.returncode == 0, done.stderr
        else:
            assert done.returncode == 2
            assert "--trust" in done.stderr
        if section != "reference" and (command[0] == "export" or section != "backend"):
            assert f'{section}.kind = "evil_mine:Mine"' in done.stderr
    assert (folder / "out.csv").exists()


def test_the_cost_of_a_class_that_a_recording_names_is_not_measured(tmp_path: Path) -> None:
    rig = bench("supervisor.start=immediate")
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), _naming("observer"))
    run(rig, duration=0.3, fast=True, sinks=[sink])
    (tmp_path / "evil_mine.py").write_text(_EVIL)
    command = ("replay", "run.mcap", "--set", "observer.kind=super_twisting", "--compare", "kalman")
    done = subprocess.run(
        [sys.executable, "-c", _WATCHED, *command, "--json", "o.json"],
        cwd=tmp_path, env=environment(), check=False, capture_output=True, text=True, timeout=240,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "TOUCHED" not in done.stdout, done.stdout
    assert not (tmp_path / "was_here").exists()
    found = json.loads((tmp_path / "o.json").read_text())["comparison"]["observers"]
    assert [one["observer"] for one in found] == ["recorded", "observer.kind=super_twisting", "kalman"]
    assert [one["cost_us"] is None for one in found] == [True, False, False]


def test_trust_imports_and_own_choice_replaces(script: Script, tmp_path: Path) -> None:
    rig = bench()
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), _naming("controller"))
    run(rig, duration=0.3, fast=True, sinks=[sink])
    (tmp_path / "evil_mine.py").write_text(_EVIL)
    refused = script("replay", "run.mcap", cwd=tmp_path)
    assert (refused.code, refused.out) == (2, "")
    replaced = script("replay", "run.mcap", "--set", "controller.kind=pd", cwd=tmp_path)
    assert (replaced.code, replaced.err) == (0, "")
    assert not (tmp_path / "was_here").exists()
    trusted = script("replay", "run.mcap", "--trust", cwd=tmp_path)
    assert (trusted.code, trusted.err) == (0, "")
    assert (tmp_path / "was_here").exists()
