"""docs/plugins.md: its code runs, as it stands there."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import pytest

from dcmp_hil import load_rig, run
from dcmp_hil.config.plugin_check import check_named
from dcmp_hil.plugins.roles import BACKEND, CONTROLLER, OBSERVER, Role

PAGE = (Path(__file__).parents[1] / "docs" / "plugins.md").read_text(encoding="utf-8")


def _blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the current folder, with the files that the page has."""
    classes, backend, script = _blocks("python")
    (rig,) = _blocks("toml")
    (tmp_path / "mine.py").write_text(classes)
    (tmp_path / "motor.py").write_text(backend)
    (tmp_path / "script.py").write_text(script)
    (tmp_path / "rig.toml").write_text(rig)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    monkeypatch.delitem(sys.modules, "motor", raising=False)
    return tmp_path


@pytest.mark.usefixtures("lab")
def test_observer_and_controller_of_the_page_run() -> None:
    rig = load_rig("rig.toml")
    check_named(rig)
    result = run(rig, duration=2.0, fast=True)
    assert result.summary.periods == 2000
    assert result.summary.tracking_rms_rad is not None
    assert result.summary.tracking_rms_rad < 0.2
    assert result.columns["difference_rad_s"].any()


@pytest.mark.usefixtures("lab")
def test_backend_of_the_page_runs() -> None:
    overrides = ["backend.kind=motor:Integrator", "supervisor.probe=off", "supervisor.monitors=finite"]
    rig = load_rig("bench-1khz", [*overrides, "controller.kind=pd", "controller.kp_1_s2=20"])
    check_named(rig)
    result = run(rig, duration=2.0, fast=True)
    assert result.summary.periods == 2000
    assert result.columns["position_rad"][-1] != 0.0


def test_script_of_the_page_runs(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(lab / "script.py"))
    assert capsys.readouterr().out.strip().endswith("1.999")
    (lab / "mine.py").write_text((lab / "mine.py").read_text() + "\nPd.update = lambda *_: None\n")
    sys.modules.pop("mine")
    runpy.run_path(str(lab / "script.py"))
    assert "mine:Pd.update returned None (mine.py, line " in capsys.readouterr().out


@pytest.mark.parametrize("role", [OBSERVER, CONTROLLER, BACKEND])
def test_page_names_what_a_class_must_have(role: Role) -> None:
    (row,) = re.findall(rf"^\| {role.key.partition('.')[0]} \|.*$", PAGE, flags=re.MULTILINE)
    assert all(method in row for method in role.methods)
    assert role.call.partition(" with")[0] in row
