"""Real processes: signals, and the files that remain."""

import json
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dcmp_hil.cli.run_sinks import dashboard, status_line
from dcmp_hil.recording.reader import read_run
from tests.telemetry.runs import entities

_TIMEOUT_S = 60.0  # s: generous, these machines are shared


def _start(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "dcmp_hil", "run", "--viewer", "none", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _wait_until_it_records(folder: Path) -> Path:
    """Wait until the first blocks are in the recording: the run is really under way."""
    deadline = time.monotonic() + _TIMEOUT_S
    while time.monotonic() < deadline:
        for recording in folder.glob("runs/*/run.rrd"):
            if recording.stat().st_size > 450_000:  # half of it is known before the first period
                return recording.parent
        time.sleep(0.05)
    raise AssertionError("the run never got under way")


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_run_keeps_what_was_recorded_when_signalled(
    tmp_path: Path, number: signal.Signals, code: int
) -> None:
    process = _start(tmp_path, "--duration", "0", "--json", "figures.json")
    folder = _wait_until_it_records(tmp_path)
    process.send_signal(number)
    out, err = process.communicate(timeout=_TIMEOUT_S)
    figures = json.loads((folder / "summary.json").read_text())
    assert process.returncode == code, err
    assert "Traceback" not in err
    assert figures["ended_by"] == number.name
    assert figures["periods"] > 100
    assert "voltage, peak" in out  # tracking has not begun yet
    assert (tmp_path / "figures.json").exists()


@pytest.mark.parametrize("options", [(), ("--compare", "kalman")])
def test_a_run_that_is_ended_while_it_starts_keeps_all_or_nothing(
    tmp_path: Path, options: tuple[str, ...]
) -> None:
    process = _start(tmp_path, "--duration", "0", *options)
    deadline = time.monotonic() + _TIMEOUT_S
    while not any(tmp_path.glob("runs/*/run.mcap")) and time.monotonic() < deadline:
        time.sleep(0.005)  # the recording is made a second before the viewer's library has loaded
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=_TIMEOUT_S)
    if runs := list(tmp_path.glob("runs/*")):  # the signal came a second late: there was a first cycle
        assert process.returncode == 0, err
        assert read_run(runs[0]).complete
    else:
        note = "ended by SIGINT before the first cycle: no device was armed, nothing is kept\n"
        assert (process.returncode, out, err) == (130, "", note)


@pytest.mark.parametrize("delay", [0.002, 0.02, 0.1, 0.3])  # s: before 0 V, in the end of the run, after it
def test_a_second_ctrl_c_loses_no_recording(tmp_path: Path, delay: float) -> None:
    process = _start(tmp_path, "--duration", "0")
    folder = _wait_until_it_records(tmp_path)
    process.send_signal(signal.SIGINT)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=_TIMEOUT_S)
    assert process.returncode in {0, 130, -signal.SIGINT}, err  # the last is of Python on its way out
    assert "Traceback" not in err
    assert read_run(folder).complete
    assert json.loads((folder / "summary.json").read_text())["ended_by"] in {"SIGINT", "KeyboardInterrupt"}


def test_recording_is_whole_when_killed(tmp_path: Path) -> None:
    process = _start(tmp_path, "--duration", "0")
    folder = _wait_until_it_records(tmp_path)
    process.kill()
    process.communicate(timeout=_TIMEOUT_S)  # until the telemetry process has left, too
    assert "joint/position_rad/lines" in entities(folder / "run.rrd")


def test_run_is_paced_by_the_wall_when_not_fast(tmp_path: Path) -> None:
    process = _start(tmp_path, "--duration", "1", "--no-record", "--json", "-")
    out, err = process.communicate(timeout=_TIMEOUT_S)
    figures = json.loads(out)
    assert process.returncode == 0, err
    assert figures["periods"] == 1000
    assert (
        figures["realtime_factor"] <= 1.01
    )  # it never runs ahead of the wall; how far behind is the machine's affair


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['dcmp-hil', '--help']\n"
        "from dcmp_hil.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print([m for m in ('numpy', 'rerun', 'pydantic', 'scipy', 'matplotlib', 'can') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_telemetry_process_does_not_import_what_the_run_does() -> None:
    code = (
        "import pickle, sys, dcmp_hil.telemetry.telemetry_worker\n"
        "pickle.loads(bytes.fromhex(sys.argv[1]))\n"
        "print([m for m in ('rerun', 'pydantic', 'scipy', 'matplotlib', 'can') if m in sys.modules])"
    )
    sent = pickle.dumps([status_line, dashboard]).hex()
    done = subprocess.run([sys.executable, "-c", code, sent], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


_STUCK = """
import sys, threading
from dcmp_hil.cli import main
from dcmp_hil.telemetry.rerun.stream_worker import THREAD
threading.Thread(target=threading.Event().wait, name=THREAD).start()  # never ends, and Python waits
sys.argv = ["dcmp-hil", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize(("arguments", "code"), [(["rigs"], 0), (["check", "no-such-rig"], 2)])
def test_a_way_to_a_viewer_that_is_stuck_does_not_hold_the_exit_up(arguments: list[str], code: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _STUCK, *arguments],
        capture_output=True,
        text=True,
        timeout=_TIMEOUT_S,
        check=False,
    )
    assert done.returncode == code
    assert ("bench-1khz" in done.stdout) == (code == 0)
    assert ("no-such-rig" in done.stderr) == (code == 2)
