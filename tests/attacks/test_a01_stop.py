"""A1: STOP against controllers that are bad to their run.

What attacks: a class of the user's own in the process of the run. It sets, ignores or blocks signals, keeps
every exception for itself, forks, sleeps in C with the interpreter's lock held, loops for ever, starts
threads, or ends the process. What is promised: STOP (`dcmp-hil stop`, the panel, Ctrl-C, SIGTERM, SIGHUP) is
confirmed by the loop's last words or forced within 1 s, the device is at 0 V within 1.1 s, and the run leaves
complete files. `make stop-bars` counts it 100 times for each kind; here some kinds are met once.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.live import run_sockets
from dcmp_hil.recording.reader import read_run
from tests.live.processes import TIMEOUT_S, command_process_of, started, until, until_running
from tools.stop_bars.attack import attack
from tools.stop_bars.bars import HOSTILE, KINDS, WAYS, Bar, table

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.installed import Finished

pytestmark = [pytest.mark.usefixtures("own_run_folder"), pytest.mark.untraced]

_MET = {
    "SignalsIgnored": "stop",
    "SignalsIgnoredInC": "Ctrl-C",
    "HandlersSetEachPeriod": "SIGTERM",
    "SwallowsForEver": "SIGINT",
    "Forks": "stop",
    "BlocksInC": "terminal",
    "BusyLoopDeaf": "panel",
}


@pytest.mark.usefixtures("needs_compiler")
@pytest.mark.parametrize(("kind", "way"), _MET.items())
def test_stop_is_confirmed_or_forced_in_time(kind: str, way: str) -> None:
    bar = attack(kind, way)
    assert bar.wrong == ()


def test_ways_and_kinds_are_those_of_the_bars() -> None:
    assert set(_MET) <= set(KINDS)
    assert set(_MET.values()) <= set(WAYS)
    good = Bar("Good", "stop", 0.01, 0.02, "confirmed", "STOP", 0, ())
    assert table([good, good._replace(wrong=("late",))]).endswith("| STOP | 0 | 1 |")


@pytest.mark.parametrize(
    ("kind", "code", "ended_by", "said"),
    [
        ("Exits", 4, "plugin", "SystemExit: 0"),
        ("ExitsAtOnce", 4, "plugin", "os._exit(0) would end the process"),
        ("Aborts", 4, "plugin", "os.abort() would end the process"),
        ("RaisesBase", 4, "plugin", "raised KeyboardInterrupt"),
        ("KillsItself", -9, "died", "ended without a word"),
    ],
)
def test_controller_that_ends_the_process_is_named_and_the_files_are_there(
    script: Callable[..., Finished], tmp_path: Path, kind: str, code: int, ended_by: str, said: str
) -> None:
    shutil.copy(HOSTILE, tmp_path / "hostile.py")
    sets = (f"controller.kind=hostile:{kind}", "supervisor.error_limit_rad=none")
    done = script(
        *("run", "bench-1khz", "--viewer", "none", "--duration", "3"),
        *(part for one in sets for part in ("--set", one)),
    )
    assert done.code == code
    (summary,) = _until_summary(tmp_path)
    assert json.loads(summary.read_text())["ended_by"] == ended_by
    errors = [line for line in done.err.splitlines() if line.startswith("error:")]
    assert len(errors) == 1 or kind == "KillsItself"  # printed by another process, a moment later
    assert said in "".join(errors) or kind == "KillsItself"
    assert "Traceback" not in done.err
    recording = summary.with_name("run.mcap")
    until(lambda: read_run(recording).complete, "the recording is whole")


def _until_summary(folder: Path) -> list[Path]:
    until(lambda: any(folder.glob("runs/*/summary.json")), "there is a summary")
    return list(folder.glob("runs/*/summary.json"))


def test_threads_and_workers_of_a_controller_hold_nothing_up(
    script: Callable[..., Finished], tmp_path: Path
) -> None:
    source = HOSTILE.read_text().replace("args=(8.0,)", "args=(1e6,)").replace("args=(30.0,)", "args=(1e6,)")
    both = "class Both(Threads, Worker):\n    def begin(self): Threads.begin(self), Worker.begin(self)\n"
    (tmp_path / "hostile.py").write_text(f"{source}\n\n{both}")
    done = script(
        *("run", "bench-1khz", "--viewer", "none", "--duration", "0.5", "--no-record"),
        *("--set", "controller.kind=hostile:Both"),
    )
    assert done.code == 0
    assert "Processes that a class of your own has started were ended: 1." in done.err


def test_fork_that_outlives_the_run_is_no_run(tmp_path: Path) -> None:
    shutil.copy(HOSTILE, tmp_path / "hostile.py")
    options = ("--viewer", "none", "--no-record", "--duration", "0", "--set", "controller.kind=hostile:Forks")
    with started(tmp_path, "run", "bench-1khz", *options, "--set", "controller.options={turns = 300}") as run:
        until_running(run)
        until(lambda: len(_processes_of(tmp_path)) > 3, "it forked")
        run.kill()
        until(lambda: run_sockets.running() == [], "no run is listed")


def _processes_of(folder: Path) -> list[int]:
    """Return the processes whose working folder is `folder`."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "cwd").readlink() == folder:
                found.append(int(process.name))
        except OSError:
            continue
    return found


@pytest.mark.parametrize("named", [True, False])
def test_stop_works_when_the_command_process_is_killed(tmp_path: Path, named: bool) -> None:
    run_options = ("--viewer", "none", "--no-record", "--duration", "0", "--json", "figures.json")
    with started(tmp_path, "run", "bench-1khz", *run_options) as run:
        until_running(run)
        os.kill(command_process_of(run.pid), signal.SIGKILL)
        done = subprocess.run(
            [sys.executable, "-m", "dcmp_hil", "stop", *(("--run", str(run.pid)) if named else ())],
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )
        run.communicate(timeout=TIMEOUT_S)
    assert (done.returncode, done.stderr) == (0, "")
    assert "confirmed after" in done.stdout
    assert json.loads((tmp_path / "figures.json").read_text())["ended_by"] == "STOP"
