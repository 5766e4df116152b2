"""A10: another user of this computer, who reads the dashboard, pushes into it, or knocks at a run's socket.

Rerun's server does not authenticate its clients, so a run ends its serving as soon as another user is
connected, and what is pushed into the server reaches no file of the run. Sockets and their folder are this
user's alone, and the kernel is asked who is at the other end.
"""

from __future__ import annotations

import json
import os
import re
import socket
import stat
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.live.client import status
from dcmp_hil.live.run_sockets import folder, socket_of
from dcmp_hil.platform import other_users
from dcmp_hil.recording.reader import read_run
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.viewer import answers
from tests.live.processes import TIMEOUT_S, started, until, until_running
from tests.panel.test_browser import free_port
from tests.telemetry.runs import VIEW, blocks, read_back, values

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("own_run_folder")

_OTHER_USER_ID = 65_534
_FORGED = "FORGED: the arm is at 0 V, safe to touch"
_PUSHES = """
import sys
import rerun as rr
rr.init("dcmp-hil", recording_id=sys.argv[2])
rr.connect_grpc(f"rerun+http://127.0.0.1:{sys.argv[1]}/proxy")
for k in range(200):
    rr.set_time("loop_time", duration=0.01 * k)
    rr.log("events/log", rr.TextLog(sys.argv[3], level="WARN"))
    rr.log("joint/position_rad/lines", rr.Scalars([77.0, 77.0]))
rr.get_global_data_recording().flush(timeout_sec=20.0)
print("pushed", flush=True)
"""
_CONNECTS = """
import socket, sys, time
held = socket.create_connection(("127.0.0.1", int(sys.argv[1])), timeout=30.0)
print("connected", flush=True)
time.sleep(60.0)
"""
_KNOCKS = """
import socket, sys
with socket.socket(socket.AF_UNIX) as knocking:
    knocking.settimeout(30.0)
    try:
        knocking.connect(sys.argv[1])
        knocking.sendall(b'{"do": "stop"}\\n')
        print("answer", knocking.recv(4096))
    except OSError as error:
        print(type(error).__name__)
"""


def _as_another_user(code: str, *arguments: str) -> subprocess.Popen[str]:
    """Run a few lines as another user, who sees no file of this checkout."""
    if os.geteuid() != 0:
        pytest.skip("this test needs another user's process: as root")
    return subprocess.Popen(
        ["/usr/bin/env", "python3", "-I", "-S", "-c", code, *arguments],
        user=_OTHER_USER_ID, cwd="/", stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_what_is_pushed_into_the_server_reaches_no_file_of_the_run(tmp_path: Path) -> None:
    port = free_port()
    run = ("run", "bench-1khz", "--viewer", "serve", "--duration", "0", "--json", "figures.json")
    with started(tmp_path, *run, first=port) as process:
        until_running(process)
        recording_id = _recording_id(next(tmp_path.glob("runs/*/run.rrd")))
        push = subprocess.run(
            [sys.executable, "-c", _PUSHES, str(port), recording_id, _FORGED],
            check=False, capture_output=True, text=True, timeout=TIMEOUT_S,
        )  # fmt: skip
        assert push.stdout == "pushed\n", push.stderr
        began = status(process.pid)["t_s"]
        until(lambda: status(process.pid)["t_s"] > began + 1.5, "the run went on")
        process.terminate()
        _, said = process.communicate(timeout=TIMEOUT_S)
    assert "FORGED" not in said
    (kept,) = (tmp_path / "runs").iterdir()
    recorded = read_run(kept)
    assert recorded.complete
    assert not [event for event in recorded.events if "FORGED" in event.text]
    assert abs(recorded.rows).max(initial=0.0, where=recorded.rows == 77.0) == 0.0
    assert "FORGED" not in str(read_back(kept / "run.rrd", "events/log"))
    assert 77.0 not in values(kept / "run.rrd", "joint/position_rad/lines")
    for written in (kept / "summary.json", tmp_path / "figures.json"):
        assert json.loads(written.read_text())["periods"] > 0
        assert "FORGED" not in written.read_text()


def _recording_id(file: Path) -> str:
    """Return what an attacker reads from the server: the number of the recording, here from its file."""
    pattern = re.compile(rb"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
    until(lambda: pattern.search(file.read_bytes()), "the recording has a number")
    found = pattern.search(file.read_bytes())
    assert found is not None
    return found[0].decode()


def test_a_dashboard_is_served_no_more_where_another_user_is_connected() -> None:
    sink = RerunSink(VIEW, None, "serve", port=free_port())
    assert sink.port is not None
    port = sink.port
    (block, *_) = blocks(100)
    sink.block(block)
    with socket.create_connection(("127.0.0.1", port)):
        time.sleep(0.2)
        sink.block(block)
    assert sink.warnings == []  # this user's own
    with _as_another_user(_CONNECTS, str(port)) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "connected\n"

        def warned() -> bool:  # at the first block after the server has accepted the connection
            sink.block(block)
            return bool(sink.warnings)

        until(warned, "the other user was seen")
        (warning,) = sink.warnings
        assert f"number {_OTHER_USER_ID}" in warning
        assert "served any more" in warning
        until(lambda: not answers(port, 0.1), "the server ended")
        other.kill()
    sink.close()


def test_this_user_s_own_viewers_are_left_alone() -> None:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        port = server.getsockname()[1]
        with socket.create_connection(("127.0.0.1", port)):
            assert other_users.strangers(port) == []


def test_the_kernel_s_table_is_read_when_a_connection_is_new(monkeypatch: pytest.MonkeyPatch) -> None:
    reads: list[int] = []

    def one_stranger(port: int) -> list[int]:
        reads.append(port)
        return [4711]

    monkeypatch.setattr(other_users, "strangers", one_stranger)
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        port = server.getsockname()[1]
        watch = other_users.StrangerWatch(port)
        assert watch.look() == [4711]  # of what was there before the first look
        assert watch.look() == []
        with socket.create_connection(("127.0.0.1", port)):
            accepted, _ = server.accept()
            assert watch.look() == [4711]
            number = accepted.fileno()
            accepted.close()
        with socket.create_connection(("127.0.0.1", port)):
            again, _ = server.accept()
            with again:
                assert again.fileno() == number  # of a descriptor, which is no name of a connection
                assert watch.look() == [4711]
        assert watch.look() == []
    assert reads == [port] * 3


def test_sockets_are_this_user_s_alone_and_the_kernel_says_who_knocks(tmp_path: Path) -> None:
    with started(tmp_path, "run", "--viewer", "none", "--no-record", "--duration", "0") as run:
        until_running(run)
        place = socket_of(run.pid)
        assert stat.S_IMODE(place.stat().st_mode) & 0o077 == 0
        assert stat.S_IMODE(folder().stat().st_mode) == 0o700
        with _as_another_user(_KNOCKS, str(place)) as refused:
            assert refused.communicate(timeout=TIMEOUT_S)[0] == "PermissionError\n"
        for path in (place.parents[1], place.parent, place):  # as if every mode were wrong
            path.chmod(0o777)
        with _as_another_user(_KNOCKS, str(place)) as unanswered:
            said = unanswered.communicate(timeout=TIMEOUT_S)[0]
        assert said in {"answer b''\n", "ConnectionResetError\n", "BrokenPipeError\n"}
        for path in (place.parents[1], place.parent):
            path.chmod(0o700)
        time.sleep(0.3)
        assert status(run.pid)["phase"] == "running"
