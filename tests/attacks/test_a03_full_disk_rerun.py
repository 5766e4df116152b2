"""A3, the part of Rerun: a disk that is full, or a call into Rerun that never returns.

Nothing of Rerun is done on the main thread, so that a run and an export hear SIGTERM and end even if Rerun
does not. The picture `run.rrd` ends while there is room for the data, and says so once. A program of ours
that serves pages ends with the process that started it.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.recording.reader import read_run
from tests.installed import environment
from tests.live.processes import until
from tests.namespaces import on_disk_of

if TYPE_CHECKING:
    from collections.abc import Callable

_TIMEOUT_S = 120.0  # s: these machines are shared
_STUCK_IN_C = """
import ctypes, sys
from dcmp_hil.telemetry.rerun import sink as rerun_sink
def stuck(target, rig, stream):
    print("stuck", file=sys.__stdout__, flush=True)
    libc, mutex = ctypes.CDLL(None), ctypes.create_string_buffer(64)
    for _ in range(2):  # the second call never returns, and no signal interrupts it
        libc.pthread_mutex_lock(mutex)
rerun_sink.begin = stuck
from dcmp_hil.cli import main
sys.argv[0] = "dcmp-hil"
main()
"""
_SERVES = """
import os, sys, time
from dcmp_hil.telemetry.rerun import viewer
port = viewer.free_port(int(sys.argv[1]))
process = viewer.start_web_viewer(port, 1)
print(process.pid, viewer.serves(port, process.pid, 60.0), flush=True)
time.sleep(600)
"""


def test_a_disk_of_64_kb_ends_a_fast_run_and_not_its_telemetry(installed: Path, tmp_path: Path) -> None:
    run = ("run", "--fast", "--duration", "1", "--viewer", "none", "--json", "figures.json")
    done = on_disk_of("64k", tmp_path, str(installed), *run)
    assert "Traceback" not in done.stderr
    assert done.stderr.count("run.rrd is not written") == 1, done.stderr
    assert json.loads((tmp_path / "figures.json").read_text())["periods"] == 1000


def test_the_picture_ends_before_the_data(installed: Path, tmp_path: Path) -> None:
    run = ("run", "--fast", "--duration", "20", "--viewer", "none")
    done = on_disk_of("5m", tmp_path, str(installed), *run)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("run.rrd ends here") == 1, done.stderr
    (folder,) = (tmp_path / "kept").iterdir()
    recorded = read_run(folder)
    assert recorded.complete
    assert len(recorded.rows) == 20_000
    assert (folder / "run.rrd").stat().st_size > 500_000
    assert (folder / "summary.json").stat().st_size > 0


@pytest.mark.parametrize("mode", [("run", "--fast", "--duration", "2"), ("export",)])
def test_a_call_into_rerun_that_never_returns_leaves_sigterm_heard(
    mode: tuple[str, ...], script: Callable[..., object], tmp_path: Path
) -> None:
    command = list(mode)
    if mode == ("export",):
        script("run", "--fast", "--duration", "0.3", "--viewer", "none")
        (folder,) = (tmp_path / "runs").iterdir()
        command += [str(folder), "--rrd", "again.rrd"]
    else:
        command += ["--viewer", "none"]
    stuck = subprocess.Popen(
        [sys.executable, "-c", _STUCK_IN_C, *command],
        cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert stuck.stdout is not None
    assert stuck.stdout.readline() == "stuck\n"
    stuck.send_signal(signal.SIGTERM)
    began = time.monotonic()
    _, said = stuck.communicate(timeout=_TIMEOUT_S)
    assert time.monotonic() - began < 60.0
    assert stuck.returncode not in {None, 0, -signal.SIGKILL}
    assert "Traceback" not in said


def test_pages_end_with_the_process_that_serves_them() -> None:
    first = 33_000 + 100 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
    with subprocess.Popen(
        [sys.executable, "-c", _SERVES, str(first)], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        pid, serves = parent.stdout.readline().split()
        assert serves == "True"
        parent.kill()
        parent.wait(_TIMEOUT_S)
    until(
        lambda: not _runs(int(pid)), "its program ended"
    )  # the kernel sends the signal with the end of the parent


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
