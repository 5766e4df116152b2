"""Rows S08, S09 and S10 of the fault catalogue, on whole runs: the loop sees nothing of it.

What a killed telemetry process costs the recording (S09) is in tests/recording; here: what it costs the run.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from dcmp_hil.recording.reader import read_run
from dcmp_hil.telemetry.rerun import viewer as window
from tests.live.processes import until
from tests.namespaces import in_own_namespace

_PERIODS = 4000
_RUN = ("run", "--duration", "4", "--json", "figures.json")
_INCOMPLETE_EXIT_CODE = 6  # exit code: the recording is
_TIMEOUT_S = 60.0
_SECOND_BYTES = 130_000  # of run.mcap, at 1 kHz
_FIRST_PORT = 27_000 + 1000 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])


class Host:
    """A `dcmp-hil run` in a folder of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY"}}
        ports = f"from dcmp_hil.telemetry.rerun import viewer; viewer.VIEWER_PORT = {_FIRST_PORT}"
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-c", f"{ports}; from dcmp_hil.cli import main; main()", *_RUN, *options],
            cwd=folder, env=environment, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
        )  # fmt: skip

    def telemetry(self) -> int:
        """Return the id of the telemetry process, once it records."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")

        def found() -> list[int]:
            pids = [int(pid) for pid in children.read_text().split()]
            return [pid for pid in pids if b"telemetry_worker" in Path(f"/proc/{pid}/cmdline").read_bytes()]

        until(lambda: any(self.folder.glob("runs/*/run.mcap")) and bool(found()), "telemetry records")
        return found()[0]

    def recorded_bytes(self) -> int:
        """Return how large its run.mcap is by now."""
        return sum(path.stat().st_size for path in self.folder.glob("runs/*/run.mcap"))

    def figures(self, code: int = 0) -> tuple[dict[str, Any], str]:
        """Wait for its end; return its figures and what it said."""
        _, said = self.process.communicate(timeout=_TIMEOUT_S)
        assert self.process.returncode == code, said
        figures: dict[str, Any] = json.loads((self.folder / "figures.json").read_text())
        return figures, " ".join(said.split())


def test_s08_a_disk_that_is_full(tmp_path: Path) -> None:
    """`runs/` is a file system of half a megabyte: each recording is a warning, every period is driven."""
    (tmp_path / "runs").mkdir()
    script = 'mount -t tmpfs -o size=512k none runs && exec "$@"'
    command = [sys.executable, "-m", "dcmp_hil", *_RUN, "--viewer", "none"]
    done = subprocess.run(
        [*in_own_namespace("mount"), "sh", "-c", script, "sh", *command],
        cwd=tmp_path, check=False, capture_output=True, text=True, timeout=_TIMEOUT_S,
    )  # fmt: skip
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert figures["periods"] == _PERIODS
    assert figures["dropped_periods"] == 0
    expected = ("incomplete", "run.mcap come first", "run.mcap waits: ")
    troubles = [sentence for sentence in figures["troubles"] if any(words in sentence for words in expected)]
    assert len(troubles) == len(figures["troubles"])
    assert 1 <= len(troubles) <= 3  # run.mcap that waits and has no end, and run.rrd
    complete = figures["recording"]["complete"]
    assert done.returncode == (0 if complete else _INCOMPLETE_EXIT_CODE), done.stderr


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_s09_telemetry_that_is_killed_or_stands_still(tmp_path: Path, number: signal.Signals) -> None:
    host = Host(tmp_path, "--viewer", "none")
    pid = host.telemetry()
    until(lambda: host.recorded_bytes() > _SECOND_BYTES, "a second was recorded")
    os.kill(pid, number)
    figures, said = host.figures(_INCOMPLETE_EXIT_CODE)
    assert figures["ended_by"] == "recording_incomplete"
    assert figures["periods"] == _PERIODS
    assert figures["dropped_periods"] == 0
    assert said.count("The telemetry process") == 1
    assert ("SIGKILL" if number == signal.SIGKILL else "did not answer") in said
    (folder,) = (tmp_path / "runs").iterdir()
    recorded = read_run(folder)
    assert not recorded.complete
    assert 0 < len(recorded.rows) < _PERIODS


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_s10_a_viewer_that_is_killed_or_stands_still(tmp_path: Path, number: signal.Signals) -> None:
    host = Host(tmp_path, "--viewer", "serve")
    telemetry = host.telemetry()
    until(lambda: bool(window.served(_FIRST_PORT)), "it was served")
    options = ["--headless", "--bind", window.LOOPBACK, "--port", "auto", "--hide-welcome-screen"]
    viewer = subprocess.Popen(
        [window.viewer_binary(), *options, "--connect", window.proxy_url(window.served(_FIRST_PORT)[0])],
        env=window.viewer_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        time.sleep(1.5)
        viewer.send_signal(number)
        resident_kb = _resident_kb(telemetry)
        figures, _ = host.figures()
    finally:
        viewer.kill()
        viewer.wait()
    assert figures["periods"] == _PERIODS
    assert figures["dropped_periods"] == 0
    assert resident_kb < 700_000
    (folder,) = (tmp_path / "runs").iterdir()
    assert len(read_run(folder).rows) == _PERIODS
    assert read_run(folder).complete


def test_s10_no_viewer_ever(tmp_path: Path) -> None:
    figures, said = Host(tmp_path, "--viewer", "connect").figures()
    assert figures["periods"] == _PERIODS
    assert "No viewer answers on 127.0.0.1:9876" in said


def _resident_kb(pid: int) -> int:
    (line,) = [
        line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS")
    ]
    return int(line.split()[1])
