"""Real runs, changed and stopped from outside; a command process that is frozen, killed, or left behind."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.live import client, run_sockets
from dcmp_hil.live.stop_command import End
from dcmp_hil.panel.run_follower import Watcher
from tests.live.processes import TIMEOUT_S, command_process_of, started, until, until_running

pytestmark = pytest.mark.usefixtures("own_run_folder")


_RUN = ("run", "bench-1khz", "--viewer", "none", "--no-record", "--duration", "0", "--json", "figures.json")


def _gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


def test_run_is_changed_and_stopped_from_outside(tmp_path: Path) -> None:
    with started(tmp_path, *_RUN) as run:
        until_running(run)
        assert client.find_run() == run.pid
        said = client.change(run.pid, ["controller.kp_1_s2=5200", "reference.amplitude_rad=0.7"])
        assert said.startswith(
            "controller.kp_1_s2: 4000 -> 5200, reference.amplitude_rad: 1 -> 0.7, applied at"
        )
        values = {knob["key"]: knob["value"] for knob in client.status(run.pid)["knobs"]}
        assert values["controller.kp_1_s2"] == 5200.0
        for refused, why in (
            ("controller.kp=3", "kp_1_s2"),
            ("amplifier.voltage_limit_V=20", "cannot be changed in a run"),
            ("supervisor.monitors=finite", "cannot be changed in a run"),
            ("controller.kd_1_s=-1", "at least 0"),
            ("reference.kind=csv", "file"),
            ("rubbish", "KEY=VALUE"),
        ):
            with pytest.raises(ConfigError, match=why):
                client.change(run.pid, [refused])
        commands = command_process_of(run.pid)
        stopped = client.stop(run.pid)
        assert stopped.end is End.CONFIRMED
        assert stopped.said.endswith("Amplifier at 0 V.")
        with suppress(ConfigError):  # it may have left already
            client.stop(run.pid)  # a second one changes nothing
        run.communicate(timeout=TIMEOUT_S)
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert run.returncode == 0
    assert figures["ended_by"] == "STOP"
    assert len(figures["changes"]) == 1
    until(lambda: _gone(commands), "the command process left", within=1.0)
    assert run_sockets.running() == []


def test_run_is_stopped_when_the_command_process_is_frozen(tmp_path: Path) -> None:
    with started(tmp_path, *_RUN) as run:
        until_running(run)
        commands = command_process_of(run.pid)
        os.kill(commands, signal.SIGSTOP)
        try:
            client.stop(run.pid)
            run.wait(timeout=TIMEOUT_S)
        finally:
            with suppress(ProcessLookupError):
                os.kill(commands, signal.SIGCONT)
    assert run.returncode == 0
    assert _gone(commands)


def test_run_goes_on_and_warns_when_the_command_process_is_killed(tmp_path: Path) -> None:
    with started(tmp_path, *_RUN) as run:
        until_running(run)
        os.kill(command_process_of(run.pid), signal.SIGKILL)
        until(lambda: not run_sockets.running(), "it listened no more")
        assert run.poll() is None
        assert run_sockets.unheard() == [run.pid]
        assert asyncio.run(_first_seen()) == ("unseen", run.pid)
        run.send_signal(signal.SIGINT)
        _, err = run.communicate(timeout=TIMEOUT_S)
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert run.returncode == 0
    assert run_sockets.unheard() == run_sockets.running() == []
    assert not run_sockets.socket_of(run.pid).exists()
    assert err.count("The command process ended") == 1
    assert sum("The command process ended" in trouble for trouble in figures["troubles"]) == 1


async def _first_seen() -> tuple[str, int]:
    """Return what a panel that is opened now shows, once it has found a run."""
    watcher = Watcher(None)
    watching = asyncio.ensure_future(watcher.watch())
    await asyncio.to_thread(until, lambda: watcher.state["connection"] != "none", "the run was found")
    watching.cancel()
    return watcher.state["connection"], watcher.state["pid"]


def test_command_process_leaves_when_its_run_is_killed(tmp_path: Path) -> None:
    with started(tmp_path, *_RUN) as run:
        until_running(run)
        commands = command_process_of(run.pid)
        run.kill()
        run.communicate(timeout=TIMEOUT_S)
        until(lambda: _gone(commands), "the command process left", within=1.0)
    assert run_sockets.running() == []


def test_run_says_why_it_does_not_listen_when_its_folder_is_not_its_own(tmp_path: Path) -> None:
    run_sockets.folder().chmod(0o755)
    with started(tmp_path, *_RUN) as run:
        assert run.stderr is not None
        said = run.stderr.readline()
        run.send_signal(signal.SIGINT)
        run.communicate(timeout=TIMEOUT_S)
    assert run.returncode == 0
    assert "The command process ended" in said
    assert "is no folder of yours alone" in said


def test_run_does_not_listen_when_that_is_wanted(tmp_path: Path) -> None:
    with started(tmp_path, *_RUN[:-4], "--duration", "0.5", "--no-control") as run:
        run.communicate(timeout=TIMEOUT_S)
    assert run.returncode == 0
    assert not any(run_sockets.folder().iterdir())


def test_commands_say_so_when_there_is_no_run() -> None:
    for arguments in (["set", "controller.kp_1_s2=5000"], ["stop"], ["status"], ["stop", "--run", "1"]):
        done = subprocess.run(
            [sys.executable, "-c", "from dcmp_hil.cli import main; main()", *arguments],
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )
        assert done.returncode == 2
        assert len(done.stderr.splitlines()) == 1
        assert "No run" in done.stderr


def test_several_runs_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client, "running", lambda: [11, 12])
    assert client.find_run(12) == 12
    with pytest.raises(ConfigError, match=r"11, 12.*--run PID"):
        client.find_run()


def test_folder_is_refused_when_others_may_use_it() -> None:
    run_sockets.folder().chmod(0o755)
    with pytest.raises(ConfigError, match="no folder of yours alone"):
        run_sockets.folder()


def test_what_a_dead_run_left_behind_is_removed() -> None:
    left = run_sockets.socket_of(4_000_000)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(left))
    assert left.exists()
    assert run_sockets.running() == []
    assert not left.exists()
