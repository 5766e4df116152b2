"""A rig that names a class of the user's own, by the installed script: beside the rig, broken, failing."""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

    Script = Callable[..., Finished]

OBSERVER = """
from dcmp_hil.control.observers.super_twisting import SuperTwisting

class Obs(SuperTwisting):
    pass
"""
CONTROLLER = """
class Pd:
    def __init__(self, context, after=1e9):
        self.ku, self.calls, self.after = context.model.ku, 0, after

    def update(self, reference, estimate):
        self.calls += 1
        if self.calls > self.after:
            return ANSWER
        u = 4000 * (reference.position - estimate.position) + 130 * (reference.velocity - estimate.velocity)
        return (u - estimate.disturbance + reference.acceleration) / self.ku
"""
QUICK = ("--fast", "--duration", "1")


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Give a folder with a rig file and the class that it names."""
    folder = tmp_path / "lab"
    folder.mkdir()
    (folder / "mine.py").write_text(OBSERVER)
    (folder / "pd.py").write_text(CONTROLLER)
    (folder / "rig.toml").write_text('name = "mine"\n[observer]\nkind = "mine:Obs"\n')
    return folder


def _runs(folder: Path) -> list[Path]:
    return sorted((folder / "runs").iterdir()) if (folder / "runs").exists() else []


def test_class_beside_the_rig_runs_and_its_recording_runs_again(script: Script, lab: Path) -> None:
    checked = script("check", "lab/rig.toml", cwd=lab.parent)
    assert (checked.code, checked.err) == (0, "")
    ran = script("run", "lab/rig.toml", *QUICK, "--json", "-", cwd=lab.parent)
    assert ran.code == 0, ran.err
    assert "Traceback" not in ran.err
    assert json.loads(ran.out)["ended_by"] == "duration"
    (run,) = _runs(lab.parent)
    moved = lab.parent / "moved"  # recording and rig lie as they lay to one another
    moved.mkdir()
    shutil.move(lab, moved / "lab")
    shutil.move(run.parent, moved / "runs")
    again = script("replay", str(_runs(moved)[0]), "--trust", cwd=moved / "lab")
    assert (again.code, again.err) == (0, "")
    assert "to the bit" in again.out


def test_paced_run_with_a_class_beside_the_rig(script: Script, lab: Path) -> None:
    ran = script("run", "lab/rig.toml", "--duration", "0.5", "--viewer", "none", cwd=lab.parent)
    assert ran.code == 0, ran.err
    assert "Traceback" not in ran.err
    (run,) = _runs(lab.parent)
    assert {"summary.json", "run.mcap", "run.rrd"} <= {file.name for file in run.iterdir()}


def test_class_in_the_current_folder_is_found_for_a_rig_elsewhere(script: Script, lab: Path) -> None:
    ran = script("run", *QUICK, "--no-record", "--set", "controller.kind=pd:Pd", cwd=lab)
    assert ran.code == 0, ran.err
    (lab / "pd.py").rename(lab.parent / "pd.py")
    ran = script(
        "run", "lab/rig.toml", *QUICK, "--no-record", "--set", "controller.kind=pd:Pd", cwd=lab.parent
    )
    assert ran.code == 0, ran.err


def test_library_is_never_replaced_by_a_file_beside_the_rig(script: Script, lab: Path) -> None:
    (lab / "json.py").write_text("raise SystemExit('the wrong one')")
    ran = script("run", "rig.toml", *QUICK, "--no-record", "--json", "-", cwd=lab)
    assert ran.code == 0, ran.err
    for command in (("check", "rig.toml"), ("run", "rig.toml", *QUICK)):
        refused = script(*command, "--set", "observer.kind=json:Obs", cwd=lab)
        assert refused.code == 2
        (line,) = refused.err.splitlines()
        assert line.startswith('error: observer.kind: got "json:Obs", but json is there twice: ')
        assert "json.py" in line
    assert _runs(lab) == []


BROKEN = {  # tests/plugins/test_error_text.py has more of them
    "syntax": ("class Obs(:\n    pass\n", "mine.py, line 1: invalid syntax"),
    "at import": ("\nimport nothing_like_it\n", "(mine.py, line 2)"),
    "in init": (
        "class Obs:\n def __init__(self, c):\n  c.nothing\n def update(self, s): ...",
        "(mine.py, line 3)",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_class_is_one_line_before_anything_runs(script: Script, lab: Path, name: str) -> None:
    text, says = BROKEN[name]
    (lab / "mine.py").write_text(text)
    commands: list[tuple[str, ...]] = [("run", "rig.toml", *QUICK)]
    if name == "syntax":
        commands += [("run", "rig.toml", "--duration", "1", "--viewer", "none"), ("check", "rig.toml")]
    for command in commands:
        done = script(*command, cwd=lab)
        assert done.code == 2, done.err
        (line,) = done.err.splitlines()
        assert line.startswith("error: observer.kind: ")
        assert says in line
        assert "mine" in line
    assert _runs(lab) == []


@pytest.mark.parametrize(
    ("answer", "pace"),
    [("1 / 0", ("--fast",)), ("__import__('numpy').array([1.0])", ("--viewer", "none"))],
    ids=["raises, in virtual time", "an array, paced"],
)
def test_class_that_fails_in_a_run_is_one_line_and_all_files_are_kept(
    script: Script, lab: Path, answer: str, pace: tuple[str, ...]
) -> None:
    (lab / "pd.py").write_text(CONTROLLER.replace("ANSWER", answer))
    own = ("--set", "controller.kind=pd:Pd", "--set", "controller.options.after=800")
    ran = script("run", "rig.toml", "--duration", "3", *pace, *own, cwd=lab)
    assert ran.code == 4, ran.err
    assert "Traceback" not in ran.err
    errors = [line for line in ran.err.splitlines() if line.startswith("error: ")]
    (line,) = errors
    assert "pd:Pd" in line
    assert "(pd.py, line " in line
    (run,) = _runs(lab)
    assert {"summary.json", "run.mcap", "run.rrd", "black_box.csv"} <= {file.name for file in run.iterdir()}
    summary = json.loads((run / "summary.json").read_text())
    assert summary["ended_by"] == "plugin"
    assert summary["periods"] == 801
    last = (run / "black_box.csv").read_text().splitlines()[-1].split(",")
    names = (run / "black_box.csv").read_text().splitlines()[0].split(",")
    assert float(last[names.index("voltage_sent_V")]) == 0.0
