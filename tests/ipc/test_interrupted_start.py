"""The start of a child is interrupted at every step: either there is an owner, or there is no child."""

from __future__ import annotations

import gc
import signal
import sys
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.ipc import child_process
from dcmp_hil.ipc.child_process import ChildProcess
from dcmp_hil.live import command_process
from dcmp_hil.live.command_process import CommandProcess
from dcmp_hil.platform import uninterrupted
from dcmp_hil.platform.uninterrupted import UninterruptedWork
from dcmp_hil.telemetry import telemetry_process
from dcmp_hil.telemetry.statistics import Statistics
from dcmp_hil.telemetry.telemetry_process import TelemetryProcess
from tests.helpers import bench
from tests.ipc.interruption import Made, is_interrupted

if TYPE_CHECKING:
    from types import ModuleType

pytestmark = pytest.mark.untraced  # hundreds of children, each with coverage of its own

BOUND = 60.0  # s: generous, these machines are shared
MODULE = "tests.ipc.child"
FILES_OF_A_CHILD = 3  # the set-up and both ends of the channel
STEPS_MIN = 10  # of a start: fewer would not be all


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Made:
    """Return a record of what is made."""
    return Made(monkeypatch)


@pytest.mark.parametrize("module", [child_process, uninterrupted])
def test_constructor_returns_an_owner_or_leaves_nothing_at_every_instruction(
    made: Made, module: ModuleType
) -> None:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    children: list[ChildProcess] = []
    step = 1
    while is_interrupted(
        lambda: children.append(ChildProcess(MODULE, None, blocked=[signal.SIGTERM])), step, module
    ):
        gc.collect()
        assert made.running == [], step
        assert made.open_files == set(), step
        assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before, step
        step += 1
    (child,) = children
    assert step > STEPS_MIN
    assert made.running == [child.pid]
    assert len(made.processes) > 1  # some of the steps come after the start of the process
    child.hang_up()
    child.end(0.0)


@pytest.mark.parametrize("when", ["before", "behind"])
@pytest.mark.parametrize("step", ["settle", "_hang_up", "end_process"])
def test_a_second_signal_leaves_no_child_either(
    made: Made, monkeypatch: pytest.MonkeyPatch, step: str, when: str
) -> None:
    """The first one comes when the child is there, the second one and a third while it is ended."""
    do = UninterruptedWork.do

    def interrupted(work: UninterruptedWork) -> None:
        do(work)
        raise KeyboardInterrupt

    monkeypatch.setattr(UninterruptedWork, "do", interrupted)
    place = UninterruptedWork if step == "settle" else child_process
    whole, left = getattr(place, step), [1, 2]

    def cut_off(*arguments: Any) -> Any:
        if when == "behind" or not left:
            whole(*arguments)
        if left:
            left.pop()
            raise KeyboardInterrupt

    monkeypatch.setattr(place, step, cut_off)
    with pytest.raises(KeyboardInterrupt):
        ChildProcess(MODULE, None)
    assert left == []
    (process,) = made.processes
    assert process.returncode == -signal.SIGKILL
    assert made.open_files == set()


def test_nothing_is_left_of_a_child_that_cannot_be_started(
    made: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    with pytest.raises(OSError, match="nowhere"):
        ChildProcess(MODULE, None, blocked=[signal.SIGTERM])
    assert made.files == FILES_OF_A_CHILD
    assert made.open_files == set()
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before


def test_child_whose_owner_is_forgotten_is_ended(made: Made) -> None:
    ChildProcess(MODULE, None)
    (process,) = made.processes
    assert process.returncode == -signal.SIGKILL
    assert made.open_files == set()


def test_child_that_was_told_of_the_end_outlives_its_owner(made: Made) -> None:
    child = ChildProcess(MODULE, None)
    assert child.receive(BOUND)
    child.hang_up()
    del child
    (process,) = made.processes
    assert process.returncode is None
    assert process.wait(BOUND) == 0


def test_telemetry_process_is_owned_or_ended_at_every_line_of_its_start(
    made: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(telemetry_process, "_WORKER_MODULE", "tests.ipc.child_that_is_up")
    apart = TelemetryProcess(Statistics(1e-3), keep=False)
    step = 1
    while is_interrupted(apart.open, step, telemetry_process, "line"):
        assert made.running == ([] if apart.pid is None else [apart.pid]), step
        apart.close()
        assert made.running == [], step
        apart = TelemetryProcess(Statistics(1e-3), keep=False)
        step += 1
    assert apart.pid is not None
    assert step > STEPS_MIN
    apart.close()
    assert made.running == []


def test_command_process_is_ended_by_close_after_every_line_of_its_start(
    made: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command_process, "_SERVER_MODULE", MODULE)
    rig, warnings, step = bench(), list[str](), 1
    commands = CommandProcess()
    while is_interrupted(
        partial(commands.open, rig, commands.file, warnings.append), step, command_process, "line"
    ):
        commands.close("", 0)
        assert made.running == [], step
        commands = CommandProcess()
        step += 1
    assert commands.pid is not None
    commands.close("", 0)
    assert made.running == []
    assert warnings == []


def test_work_that_has_not_begun_is_not_done_after_settling() -> None:
    calls: list[int] = []
    work = UninterruptedWork(lambda: calls.append(1))
    work.settle()
    work.do()
    assert calls == []


def test_work_raises_where_it_is_waited_for_and_may_be_interrupted_by_nothing() -> None:
    threads: list[int] = []

    def fail() -> None:
        threads.append(threading.get_ident())
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        UninterruptedWork(fail).do()
    assert threads != [threading.main_thread().ident]


def test_want_of_a_thread_is_an_error_of_the_system(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("_thread.start_new_thread", refuse)
    with pytest.raises(OSError, match="new thread"):
        ChildProcess(MODULE, None)
