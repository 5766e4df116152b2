"""A1: the parts of STOP, in this process: word, last words, signals, state, handlers, forks."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.device.links.serial import open_port
from dcmp_hil.ipc.mailbox import MAILBOX_BYTES, STOP_REQUEST, Mailbox
from dcmp_hil.ipc.ring import Ring, size_of
from dcmp_hil.ipc.run_end import AT_ZERO, FORCED, LIVES, NOT_ARMED, UNCONFIRMED
from dcmp_hil.ipc.shared_memory import mapped, reserve
from dcmp_hil.live import stop_command
from dcmp_hil.live.command_server import CommandSetup, Server
from dcmp_hil.live.stop_command import End, stop_run
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.inherited_descriptors import forget, keep_from_forks
from dcmp_hil.platform.stop_request import Interrupted, StopRequest
from dcmp_hil.telemetry.parent_exit import how_it_died
from dcmp_hil.values import Truth
from tests.helpers import bench, cycle
from tests.live.here import ChangedRun
from tests.live.processes import TIMEOUT_S, until

if TYPE_CHECKING:
    from dcmp_hil.values import Sample

pytestmark = pytest.mark.usefixtures("own_run_folder")


class _StoppedRun(ChangedRun):
    """A run in whose mailbox STOP is put before a certain sample."""

    def _read(self, k: int, sample: Sample) -> Sample:
        if k == 700:
            self.control.mailbox.ask_stop(self.by)
        return super()._read(k, sample)

    by = STOP_REQUEST


@pytest.mark.parametrize(("by", "said"), [(STOP_REQUEST, "STOP"), (signal.SIGTERM, "SIGTERM")])
def test_stop_is_a_word_that_the_loop_takes_in_the_period(by: int, said: str) -> None:
    run = _StoppedRun({})
    run.by = by
    result = run.run()
    assert result.summary.periods in {700, 701}
    assert run.control.mailbox.stop_taken
    assert run.control.end == AT_ZERO
    assert run.held.session.stop.asked_by == said


@pytest.mark.parametrize(
    ("number", "end", "said"),
    [
        (AT_ZERO, End.CONFIRMED, "confirmed after 0 ms"),
        (NOT_ARMED, End.CONFIRMED, "confirmed after 0 ms"),
        (UNCONFIRMED, End.UNCONFIRMED, "the run ended after"),
    ],
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
    assert stop_command.STOP_TIME_MAX_S >= 1.0


class _Owner:
    """Keeps memory open."""


def test_state_is_silent_when_no_period_came_for_half_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    owner = _Owner()
    mailbox, ring = reserve(owner, "mailbox"), reserve(owner, "ring")
    rows = Ring(16, mapped(ring, size_of(16)))
    server = Server(
        CommandSetup(bench(), mailbox, ring), Mailbox(mapped(mailbox, MAILBOX_BYTES)), os.getpid()
    )
    Mailbox(mapped(mailbox, MAILBOX_BYTES)).tell_phase(4)
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
    mailbox = Mailbox(mapped(file, MAILBOX_BYTES))
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
            time.sleep(TIMEOUT_S)
            os._exit(0)
        until(lambda: (tmp_path / "handler").exists() and (tmp_path / "handler").read_text(), "it forked")
        stop.wake_no_more()
        forget(ours.fileno())
        ours.close()
        theirs.settimeout(TIMEOUT_S)
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
        time.sleep(TIMEOUT_S)
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
        [sys.executable, "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
