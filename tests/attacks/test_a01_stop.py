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
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.links.serial import open_port
from dcmp_hil.ipc.mailbox import SIZE, STOP, Mailbox
from dcmp_hil.ipc.ring import Ring, size_of
from dcmp_hil.ipc.run_end import AT_ZERO, FORCED, LIVES, UNCONFIRMED
from dcmp_hil.ipc.shared_memory import mapped, reserve
from dcmp_hil.live import places, stopping
from dcmp_hil.live.control import Server, Setup
from dcmp_hil.live.stopping import End, stop_run
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.inherited_descriptors import forget, keep_from_forks
from dcmp_hil.platform.stop_request import Interrupted, StopRequest
from dcmp_hil.recording.reader import read_run
from dcmp_hil.telemetry.died import how_it_died
from dcmp_hil.values import Truth
from tests.firmware.core_library import compiler
from tests.helpers import bench, cycle
from tests.live.here import ChangedRun
from tests.live.processes import BOUND, control_of, own_folder, started, until, until_running
from tools.stop_bars import HOSTILE, KINDS, WAYS, Bar, attack, table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.values import Sample
    from tests.installed import Finished

_MET = {
    "SignalsIgnored": "stop",
    "SignalsIgnoredInC": "Ctrl-C",
    "HandlersSetEachPeriod": "SIGTERM",
    "SwallowsForEver": "SIGINT",
    "Forks": "stop",
    "BlocksInC": "terminal",
    "BusyLoopDeaf": "panel",
}


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with own_folder(monkeypatch):
        yield


# ---------------------------------------------------------------- real runs


@pytest.fixture(scope="module")
def _compiled() -> None:
    compiler()


@pytest.mark.usefixtures("_compiled")
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
        until(lambda: places.running() == [], "no run is listed")


def _processes_of(folder: Path) -> list[int]:
    """Return the processes that work in a folder."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "cwd").readlink() == folder:
                found.append(int(process.name))
        except OSError:
            continue
    return found


def test_stop_works_when_the_control_process_is_killed(tmp_path: Path) -> None:
    run_options = ("--viewer", "none", "--no-record", "--duration", "0", "--json", "figures.json")
    with started(tmp_path, "run", "bench-1khz", *run_options) as run:
        until_running(run)
        os.kill(control_of(run.pid), signal.SIGKILL)
        done = subprocess.run(
            [sys.executable, "-m", "dcmp_hil", "stop", "--run", str(run.pid)],
            capture_output=True,
            text=True,
            timeout=BOUND,
            check=False,
        )
        run.communicate(timeout=BOUND)
    assert (done.returncode, done.stderr) == (0, "")
    assert "confirmed after" in done.stdout
    assert json.loads((tmp_path / "figures.json").read_text())["ended_by"] == "STOP"


# ---------------------------------------------------------------- its parts, in this process


class _StoppedRun(ChangedRun):
    """A run in whose mailbox STOP is put before a certain sample."""

    def _read(self, k: int, sample: Sample) -> Sample:
        if k == 700:
            self.control.mailbox.ask_stop(self.by)
        return super()._read(k, sample)

    by = STOP


@pytest.mark.parametrize(("by", "said"), [(STOP, "STOP"), (signal.SIGTERM, "SIGTERM")])
def test_stop_is_a_word_that_the_loop_takes_in_the_period(by: int, said: str) -> None:
    run = _StoppedRun({})
    run.by = by
    result = run.run()
    assert result.summary.periods in {700, 701}
    assert run.control.mailbox.stop_taken
    assert run.control.confirmed
    assert run.held.session.stop.asked_by == said


@pytest.mark.parametrize(
    ("number", "end", "said"),
    [(AT_ZERO, End.CONFIRMED, "confirmed after 0 ms"), (UNCONFIRMED, End.UNCONFIRMED, "the run ended after")],
)
def test_stop_tells_the_last_words(number: int, end: End, said: str) -> None:
    mailbox = Mailbox()
    mailbox.tell_end("Amplifier at some voltage.", number)
    stopped = stop_run(os.getpid(), mailbox, lambda: True)
    assert stopped.end is end
    assert stopped.said.startswith(said)
    assert stopped.said.endswith("Amplifier at some voltage.")


def test_stop_goes_from_word_to_signals_and_says_what_ended_the_run() -> None:
    code = (
        "import signal, time\nfor n in (1, 2, 15): signal.signal(n, signal.SIG_IGN)\n"
        "print('x', flush=True)\ntime.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.read(1)
        mailbox = Mailbox()
        stopped = stop_run(process.pid, mailbox, lambda: process.poll() is None, watchdog="within 20 ms")
    assert process.returncode == -signal.SIGKILL
    assert mailbox.end == FORCED
    assert stopped.end is End.FORCED
    assert "did not answer and was killed" in stopped.said
    assert stopped.said.endswith("the device goes to 0 V by its watchdog within 20 ms.")


def test_stop_that_changes_nothing_is_told_as_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[int] = []
    monkeypatch.setattr(os, "kill", lambda _, number: sent.append(number))
    stopped = stop_run(1 << 22, Mailbox(), lambda: True)
    assert stopped.end is End.FAILED
    assert sent == [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]
    assert stopping.LIMIT >= 1.0


class _Owner:
    """Keeps memory open."""


def test_state_is_silent_when_no_period_came_for_half_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    owner = _Owner()
    mailbox, ring = reserve(owner, "mailbox"), reserve(owner, "ring")
    rows = Ring(16, mapped(ring, size_of(16)))
    server = Server(Setup(bench(), mailbox, ring), Mailbox(mapped(mailbox, SIZE)), os.getpid())
    Mailbox(mapped(mailbox, SIZE)).tell_phase(4)
    rows.push(cycle(1.0, position=0.5, applied=2.0), Truth(0.0, 0.0, 0.0))
    server.look()
    fresh = server.state()
    now_ns = MonotonicClock().now_ns()
    monkeypatch.setattr(MonotonicClock, "now_ns", staticmethod(lambda: now_ns + 600_000_000))
    stale = server.state()
    assert (fresh["phase"], stale["phase"]) == ("running", "silent")
    assert stale["age_s"] == pytest.approx(0.6, abs=0.1)


@pytest.mark.parametrize(
    ("end", "parent", "word"),
    [(LIVES, 1, "died"), (FORCED, 1, "STOP_FORCED"), (AT_ZERO, os.getppid(), None)],
)
def test_end_of_a_run_is_told_by_what_it_said_and_whether_it_lives(
    end: int, parent: int, word: str | None
) -> None:
    owner = _Owner()
    file = reserve(owner, "mailbox")
    mailbox = Mailbox(mapped(file, SIZE))
    if end == FORCED:
        mailbox.tell_forced()
    elif end == AT_ZERO:
        mailbox.tell_end("Amplifier at 0 V.", AT_ZERO)
    death = how_it_died(file, -1 if parent == 1 else parent)
    assert (death.word if death else None) == word


def test_handlers_stay_those_of_the_run() -> None:
    before = signal.signal
    with StopRequest() as stop:
        mine = signal.getsignal(signal.SIGINT)
        assert signal.signal(signal.SIGINT, signal.SIG_IGN) != mine
        assert signal.getsignal(signal.SIGINT) == mine
        assert stop.refused == {signal.SIGINT}
        before(signal.SIGTERM, signal.SIG_IGN)  # in another way
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGHUP])
        stop.reinstall()
        assert signal.getsignal(signal.SIGTERM) == mine
        assert signal.SIGHUP not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.asked_by == "SIGTERM"
    assert signal.signal is before


def test_escalation_interrupts_what_hangs() -> None:
    with StopRequest() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        assert stop.asked_by == "SIGINT"
        with pytest.raises(Interrupted):
            os.kill(os.getpid(), signal.SIGTERM)


def test_fork_has_neither_handlers_nor_lines_of_the_run(tmp_path: Path) -> None:
    ours, theirs = socket.socketpair()
    keep_from_forks(ours.fileno())
    with StopRequest() as stop, ours, theirs:
        ours.setblocking(False)
        stop.wake(ours.fileno())
        mine = signal.getsignal(signal.SIGTERM)
        pid = os.fork()
        if pid == 0:  # pragma: no cover - another process
            handler = signal.getsignal(signal.SIGTERM)
            (tmp_path / "handler").write_text(str(handler == mine))
            time.sleep(BOUND)
            os._exit(0)
        until(lambda: (tmp_path / "handler").exists() and (tmp_path / "handler").read_text(), "it forked")
        stop.wake_no_more()
        forget(ours.fileno())
        ours.close()
        theirs.settimeout(BOUND)
        assert theirs.recv(1) == b""  # the fork does not hold it
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    assert (tmp_path / "handler").read_text() == "False"


def test_fork_does_not_keep_the_lock_of_a_port(tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    path = os.ttyname(theirs)
    port = open_port(path, 1_000_000)
    pid = os.fork()
    if pid == 0:  # pragma: no cover - another process
        (tmp_path / "forked").touch()
        time.sleep(BOUND)
        os._exit(0)
    try:
        until((tmp_path / "forked").exists, "it forked")
        port.close()
        open_port(path, 1_000_000).close()
    finally:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        os.close(ours)
        os.close(theirs)


@pytest.mark.parametrize("at", ["dcmp_hil.cli.check", "dcmp_hil.errors", "typer"])
def test_ctrl_c_while_python_imports_is_quiet(tmp_path: Path, at: str) -> None:
    code = (
        "import builtins, os, signal, sys\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a background job ignores it
        "real = builtins.__import__\n"
        "def importing(name, *rest, **more):\n"
        f"    if name == {at!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "    return real(name, *rest, **more)\n"
        "builtins.__import__ = importing\n"
        "from dcmp_hil.__main__ import main\n"
        "sys.argv = ['dcmp-hil', 'rigs']\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=BOUND, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
