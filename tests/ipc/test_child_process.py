"""A child process: what it is given, and what either side knows of the other one's end."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
from ast import literal_eval
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.ipc.child_process import ChildProcess, how_it_ended

if TYPE_CHECKING:
    from collections.abc import Iterator

BOUND = 60.0  # s: generous, these machines are shared
MODULE = "tests.ipc.child"
_PARENT = """
import os, signal, sys
from dcmp_hil.ipc.child_process import ChildProcess
child = ChildProcess("tests.ipc.orphan", None, arguments=[int(sys.argv[1])])
assert child.receive(60.0)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def children() -> Iterator[list[ChildProcess]]:
    """Collect processes that are ended after the test."""
    started: list[ChildProcess] = []
    yield started
    for child in started:
        child.hang_up()
        child.end(0.0)


@pytest.mark.parametrize("kind", [socket.SOCK_STREAM, socket.SOCK_SEQPACKET])
def test_child_has_setup_descriptors_and_blocked_signals(
    kind: socket.SocketKind, children: list[ChildProcess]
) -> None:
    file = os.memfd_create("given")
    os.write(file, b"words")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    child = ChildProcess(
        MODULE, {"key": (1, 2.5)}, arguments=[file], kind=kind, blocked=[signal.SIGHUP, signal.SIGTERM]
    )
    children.append(child)
    os.close(file)
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before
    assert child.is_heard(BOUND)
    setup, contents, blocked = literal_eval(child.receive(BOUND).decode())
    assert (setup, contents) == ({"key": (1, 2.5)}, ["words"])
    assert {"SIGHUP", "SIGTERM"} <= set(blocked)


def test_child_sees_that_the_parent_hangs_up_and_leaves(children: list[ChildProcess]) -> None:
    child = ChildProcess(MODULE, None)
    children.append(child)
    assert child.receive(BOUND)
    child.hang_up()
    assert how_it_ended(child.end(BOUND)) == "left"


def test_parent_sees_at_once_that_a_child_was_killed(children: list[ChildProcess]) -> None:
    child = ChildProcess(MODULE, None, kind=socket.SOCK_SEQPACKET)
    children.append(child)
    assert child.receive(BOUND)
    os.kill(child.pid, signal.SIGKILL)
    assert child.is_heard(BOUND)
    assert child.receive_from_working(BOUND) == b""
    assert how_it_ended(child.end(BOUND)) == "was ended by SIGKILL"


def test_child_sees_that_its_parent_was_killed() -> None:
    ours, theirs = os.pipe()
    code = [sys.executable, "-c", _PARENT, str(theirs)]
    parent = subprocess.run(code, pass_fds=[theirs], check=False, timeout=BOUND)
    os.close(theirs)
    assert parent.returncode == -signal.SIGKILL
    assert select.select([ours], [], [], BOUND)[0]
    assert os.read(ours, 100) == b"gone"
    os.close(ours)
