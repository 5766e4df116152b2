"""Simulation, replay and export need no module that only POSIX systems have; the rest says so in words."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tests.installed import environment

if TYPE_CHECKING:
    from pathlib import Path

POSIX_ONLY = ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty")
BLOCKED = f"""
import sys
sys.modules.update(dict.fromkeys({POSIX_ONLY!r}))
sys.argv[0] = "dcmp-hil"
from dcmp_hil.cli import main
main()
"""


def run_blocked(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", BLOCKED, *arguments]
    return subprocess.run(
        command, cwd=folder, env=environment(), capture_output=True, text=True, timeout=300, check=False
    )


def test_virtual_time_works_without_posix_modules(tmp_path: Path) -> None:
    ran = run_blocked(tmp_path, "run", "--fast", "--duration", "1", "--json", "figures.json")
    assert ran.returncode == 0
    assert [line for line in ran.stderr.splitlines() if line.startswith("error") or "Traceback" in line] == []
    (folder,) = (tmp_path / "runs").iterdir()
    assert {"run.mcap", "summary.json"} <= {path.name for path in folder.iterdir()}
    for command in (
        ["replay", str(folder)],
        ["export", str(folder), "--csv", "run.csv"],
        ["replay", "run.csv"],
        ["paper", "--json", "paper.json"],
        ["check", "bench-can"],
        ["rigs"],
    ):
        done = run_blocked(tmp_path, *command)
        assert done.returncode == 0, command
        assert "Traceback" not in done.stderr
        assert "error:" not in done.stderr
    assert (tmp_path / "run.csv").stat().st_size > 10_000


@pytest.mark.parametrize(
    "command",
    [
        ["run", "--duration", "1"],
        ["device"],
        ["ports"],
        ["monitor", "bench-serial"],
        ["set", "controller.kd_1_s=140"],
        ["stop"],
        ["status"],
        ["panel"],
    ],
    ids=" ".join,
)
def test_what_needs_linux_says_so(tmp_path: Path, command: list[str]) -> None:
    done = run_blocked(tmp_path, *command)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: ")
    assert "Linux only" in line
    assert list(tmp_path.iterdir()) == []
