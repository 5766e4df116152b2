"""Standard output and error that end early, are full, closed, or lack characters: files and codes stay."""

from __future__ import annotations

import json
import os
import pty
import re
import shutil
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

from tests.installed import environment

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

    Script = Callable[..., Finished]

BASH = shutil.which("bash")
TIMEOUT_S = 120.0  # s: these machines are shared
KEPT = {"summary.json", "run.mcap", "run.rrd", "run.png"}
TRIP = "run --fast --duration 6 --viewer none --fault plant.enc_stuck:at=3s"

pytestmark = pytest.mark.skipif(BASH is None, reason="bash is not installed")


def shell(installed: Path, folder: Path, command: str, **env: str | None) -> tuple[int, str]:
    """Run a line of bash in which `dcmp-hil` is the installed script; return its code and what was printed.

    The code is that of the first command of a pipeline.
    """
    line = f'dcmp-hil() {{ "{installed}" "$@"; }}; {command}; exit "${{PIPESTATUS[0]}}"'
    done = subprocess.run(
        [str(BASH), "-c", line],
        cwd=folder,
        env=environment(**env),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="surrogateescape",
        timeout=TIMEOUT_S,
        check=False,
    )
    return done.returncode, done.stdout


def kept(folder: Path) -> dict[str, object]:
    """Return the summary of the only run there, all of whose files must be there as well."""
    (run,) = (folder / "runs").iterdir()
    figures: dict[str, object] = json.loads((run / "summary.json").read_text("utf-8"))
    tripped = {"black_box.csv"} if figures["ended_by"] == "stuck" else set()
    assert {path.name for path in run.iterdir()} == KEPT | tripped
    assert all(path.stat().st_size > 1000 for path in run.iterdir())
    return figures


@pytest.mark.parametrize(
    "streams",
    [">/dev/full 2>/dev/full", ">&- 2>&- <&-"],
)
def test_run_keeps_everything_when_its_output_goes_nowhere(
    installed: Path, tmp_path: Path, streams: str
) -> None:
    command = f"dcmp-hil run --fast --duration 1 --viewer none --json figures.json {streams}"
    code, said = shell(installed, tmp_path, command, MPLBACKEND="no_such_backend")
    assert (code, said) == (0, "")
    figures = kept(tmp_path)
    assert figures["periods"] == 1000
    assert figures["troubles"] == []
    assert json.loads((tmp_path / "figures.json").read_text())["periods"] == 1000


def test_trip_keeps_black_box_error_and_exit_code_when_figures_go_nowhere(
    installed: Path, tmp_path: Path
) -> None:
    code, said = shell(installed, tmp_path, f"dcmp-hil {TRIP} | true")
    assert code == 4
    assert "Traceback" not in said
    assert said.count("error:") == 1
    assert kept(tmp_path)["ended_by"] == "stuck"


def test_run_ends_well_when_ctrl_c_ends_its_reader_too(installed: Path, tmp_path: Path) -> None:
    line = (
        f'"{installed}" run --duration 0 --viewer none 2>&1 | tee log.txt; echo "${{PIPESTATUS[0]}}" > code'
    )
    shell_process = subprocess.Popen(
        [str(BASH), "-c", line], cwd=tmp_path, env=environment(), start_new_session=True
    )
    wait_until_it_runs(tmp_path)
    os.killpg(shell_process.pid, signal.SIGINT)  # as a terminal sends it: to the whole pipeline
    shell_process.wait(TIMEOUT_S)
    wait_for(lambda: (tmp_path / "code").exists() or any(tmp_path.glob("runs/*/summary.json")))
    (run,) = (tmp_path / "runs").iterdir()
    figures = json.loads((run / "summary.json").read_text())
    assert figures["ended_by"] == "SIGINT"
    assert figures["troubles"] == []
    assert not (tmp_path / "code").exists() or (tmp_path / "code").read_text() == "0\n"
    assert {path.name for path in run.iterdir()} == KEPT - {"run.png"}


def test_run_ends_well_when_its_terminal_is_closed(installed: Path, tmp_path: Path) -> None:
    """The code is what a terminal that hangs up makes of it: SIGHUP, and EIO for every word after it."""
    child, terminal = pty.fork()
    if child == 0:  # a session of its own on that terminal, as a shell has it
        os.chdir(tmp_path)
        command = [str(installed), "run", "--duration", "0", "--viewer", "none"]
        os.execve(installed, command, environment())  # noqa: S606
    reading = True

    def runs() -> bool:
        nonlocal reading
        if reading:
            reading = bool(os.read(terminal, 65536))
        return started(tmp_path)

    wait_for(runs)
    os.close(terminal)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 129
    (run,) = (tmp_path / "runs").iterdir()
    figures = json.loads((run / "summary.json").read_text())
    assert figures["ended_by"] == "SIGHUP"
    assert figures["troubles"] == []


def test_run_prints_figures_in_an_encoding_that_lacks_signs(script: Script, tmp_path: Path) -> None:
    done = script(
        *("run", "--fast", "--duration", "1", "--viewer", "none", "--fault", "host.slow:ms=3,at=500ms"),
        env={"PYTHONIOENCODING": "latin-1:strict"},
        encoding="latin-1",
    )
    assert done.code == 0
    assert kept(tmp_path)["periods"] == 1000
    assert "Traceback" not in done.err
    assert "velocity error, RMS" in done.out
    (heading,) = (line for line in done.out.splitlines() if "p50" in line)
    (durations,) = (line for line in done.out.splitlines() if line.startswith("sample to command"))
    assert heading.index("p50") == durations.index("0.0")  # the columns are as wide as ever
    assert re.search(r"<1 µs [-._=+*%# ]+ <5 ms", durations)


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("--help 2>&1 | head -1 >/dev/null", 0),
        ("run --help >/dev/full", 0),
        ("--version >&- 2>&-", 0),
        ("rigs | true", 0),
        ("check paper >/dev/full", 0),
        ("check nope 2>/dev/full", 2),
        ("run --no-such-option 2>&-", 2),
        ("status 2>&-", 2),
    ],
)
def test_command_keeps_its_exit_code_when_its_output_is_lost(
    installed: Path, tmp_path: Path, command: str, code: int
) -> None:
    assert shell(installed, tmp_path, f"dcmp-hil {command}", XDG_RUNTIME_DIR=str(tmp_path)) == (code, "")
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("command", ["run --help", "check bench-1khz"])
def test_text_is_plain_where_the_encoding_is(installed: Path, tmp_path: Path, command: str) -> None:
    code, said = shell(installed, tmp_path, f"dcmp-hil {command}", PYTHONIOENCODING="ascii")
    assert code == 0
    assert said.isascii()
    assert "Traceback" not in said
    assert "?" not in said  # every character that we print has a substitute


def test_monitor_ends_when_its_reader_leaves(installed: Path, tmp_path: Path) -> None:
    device = subprocess.Popen(
        [str(installed), "device", "--symlink", "port"],
        cwd=tmp_path,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert device.stdout is not None
        assert device.stdout.readline().strip() == "port"
        monitor = "dcmp-hil monitor bench-serial --set backend.port=./port 2>log.txt | head -1"
        code, said = shell(installed, tmp_path, monitor)
        assert code == 0
        assert said.count("\n") == 1
        assert "Traceback" not in (tmp_path / "log.txt").read_text()
    finally:
        device.terminate()
        device.wait(TIMEOUT_S)
        if device.stdout is not None:
            device.stdout.close()


def started(folder: Path) -> bool:
    return any(path.stat().st_size > 30_000 for path in folder.glob("runs/*/run.mcap"))


def wait_until_it_runs(folder: Path) -> None:
    wait_for(lambda: started(folder))


def wait_for(what: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not what():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_stream_that_is_replaced_does_not_close_its_descriptor(tmp_path: Path) -> None:
    """A program that forks us may have made its own `sys.stderr` on descriptor 2."""
    program = (
        "import gc, os, sys\n"
        "sys.stderr = os.fdopen(2, 'w')\n"
        "from dcmp_hil.cli import streams\n"
        "streams.guard()\n"
        "gc.collect()\n"
        "print('still there', file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert done.stderr == "still there\n"
