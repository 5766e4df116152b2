"""A Python process of our own: started with a set-up, tied to this one by a channel, waited for and ended.

Both sides notice by the channel that the other one has gone, and the child by the number of its parent.
"""

from __future__ import annotations

import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import weakref
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.ipc.shared_memory import Log, reserve
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.inherited_descriptors import forget, keep_from_forks
from dcmp_hil.platform.python_command import python_command
from dcmp_hil.platform.uninterrupted import UninterruptedWork

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

MESSAGE_BYTES_MAX = 1 << 16
"""Bytes of the longest message."""
_WORK_TIMEOUT_S = 60.0  # s that a process has which works at its answer
_UNDO_TRIALS_MAX = 10  # of which each but the last was interrupted; a child without an owner is ended, too
_CODE = """
import sys
sys.path[:] = {path!r}
from dcmp_hil.ipc.child_process import ParentProcess
from {module} import main
main(ParentProcess({parent}, {channel}, {setup}), *{arguments})
"""


class ChildProcess:
    """A child as its parent sees it.

    The constructor returns the owner of a child, or raises and leaves no child: also where the handlers of
    signals raise in it. A child whose owner is forgotten before `hang_up` is ended.

    Parameters
    ----------
    module
        Its `main(parent, *arguments)` is called there, `parent` being a ParentProcess.
    setup
        What `parent.setup` is there: an object that can be pickled.
    shared
        Descriptors that the child has as well, under the same numbers.
    arguments
        Descriptors, the same, that `main` takes.
    kind
        Of the socket: a stream, or messages.
    environment
        Of the child; None for that of this process.
    blocked
        Signals that wait until the child unblocks them.

    Attributes
    ----------
    process
        As `subprocess` has it.
    channel
        A socket that never blocks; closed by `hang_up`, which the child notices.

    Raises
    ------
    OSError
        If it cannot be started.
    """

    _ending: weakref.finalize[..., ChildProcess] | None = None  # while this object alone owns the child

    def __init__(
        self,
        module: str,
        setup: object,
        *,
        shared: Sequence[int] = (),
        arguments: Sequence[int] = (),
        kind: socket.SocketKind = socket.SOCK_STREAM,
        environment: Mapping[str, str] | None = None,
        blocked: Collection[signal.Signals] = (),
    ) -> None:
        start = UninterruptedWork(
            partial(self._start, module, setup, shared, arguments, kind, environment, blocked)
        )
        try:
            start.do()
        except BaseException:  # `_start` failed and left nothing behind, or a signal came at any instant
            self._undo(start)
            raise

    def _undo(self, start: UninterruptedWork) -> None:
        """End what was started, and again where a further signal interrupts that."""
        for _ in range(_UNDO_TRIALS_MAX):
            with suppress(KeyboardInterrupt):
                start.settle()
                if self._ending:
                    _end_unowned(self.channel, self.process)
                    self._ending.detach()
                return

    def _start(
        self,
        module: str,
        setup: object,
        shared: Sequence[int],
        arguments: Sequence[int],
        kind: socket.SocketKind,
        environment: Mapping[str, str] | None,
        blocked: Collection[signal.Signals],
    ) -> None:
        """Start it, on a thread of its own, whose signal mask the child inherits."""
        signal.pthread_sigmask(signal.SIG_BLOCK, blocked)
        self._setup = reserve(self, "setup")
        Log(self._setup).append(pickle.dumps(setup))
        ours, theirs = socket.socketpair(socket.AF_UNIX, kind)
        with theirs, ExitStack() as undo:
            undo.callback(_hang_up, ours)
            keep_from_forks(ours.fileno())
            ours.setblocking(False)
            code = _CODE.format(
                path=sys.path,
                module=module,
                parent=os.getpid(),
                channel=theirs.fileno(),
                setup=self._setup,
                arguments=tuple(arguments),
            )
            self.process = subprocess.Popen(  # noqa: S603 - our own code
                python_command(code),
                pass_fds=[theirs.fileno(), self._setup, *arguments, *shared],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # figures go there, and nothing else
                env=environment,
            )
            undo.callback(end_process, self.process, 0.0)
            self.channel = ours
            self._ending = weakref.finalize(self, _end_unowned, ours, self.process)
            self._ending.atexit = False  # the child sees the end of this process, and finishes its work
            undo.pop_all()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self.process.pid

    def is_heard(self, within: float) -> bool:
        """Return whether it sends something, or has gone, within so many seconds."""
        return bool(select.select([self.channel], [], [], within)[0])

    def receive(self, within: float) -> bytes:
        """Return the next message; nothing if there is none in time, or never will be."""
        self.channel.settimeout(max(within, 1e-3))
        try:
            return self.channel.recv(MESSAGE_BYTES_MAX)
        except OSError:
            return b""
        finally:
            self.channel.setblocking(False)  # a socket with a timeout waits even where it is told not to

    def receive_from_working(self, idle: float) -> bytes:
        """Return the next message; nothing once it has done nothing for `idle` (s), or has ended."""
        clock = MonotonicClock()
        end_ns = clock.now_ns() + int(_WORK_TIMEOUT_S * 1e9)
        used = _cpu_time(self.pid)
        while not (answer := self.receive(idle)) and clock.now_ns() < end_ns:
            before, used = used, _cpu_time(self.pid)
            if used is None or used == before:
                return b""
        return answer

    def say_no_more(self) -> None:
        """Have the child see the end of what it is sent; it may still answer."""
        with suppress(OSError):
            self.channel.shutdown(socket.SHUT_WR)

    def hang_up(self) -> None:
        """Close the channel. From then on the child ends by itself, or by `end`."""
        if self._ending:  # first: a signal between the two leaves a child that sees the end of its channel
            self._ending.detach()
        _hang_up(self.channel)

    def end(self, within: float) -> int:
        """Wait for it so many seconds, then kill it; return how it ended."""
        return end_process(self.process, within)


class ParentProcess:
    """The parent as its child sees it.

    Parameters
    ----------
    pid
        Its number.
    channel, setup
        Descriptors: of the socket between the two, and of the pickled set-up.

    Attributes
    ----------
    pid
        Its number.
    channel
        The socket between the two.
    """

    def __init__(self, pid: int, channel: int, setup: int) -> None:
        self.pid, self._setup = pid, setup
        self.channel = socket.socket(fileno=channel)

    @property
    def setup(self) -> Any:
        """Return a new copy of what the parent gave."""
        data = os.pread(self._setup, os.fstat(self._setup).st_size, 0)
        return pickle.loads(data)  # noqa: S301 - written by our own parent

    @property
    def lives(self) -> bool:
        """Whether it is there."""
        return parent_lives(self.pid)


def parent_lives(pid: int) -> bool:
    """Return whether the process that started this one is there: once it is gone, another is the parent."""
    return os.getppid() == pid


def _cpu_time(pid: int) -> int | None:
    """Return the clock ticks that a process has used, as the kernel counts them; None if it has ended."""
    try:
        state, *fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    except OSError:
        return None
    return None if state == "Z" else int(fields[10]) + int(fields[11])


def _hang_up(channel: socket.socket) -> None:
    if channel.fileno() >= 0:
        forget(channel.fileno())
        channel.close()


def _end_unowned(channel: socket.socket, process: subprocess.Popen[bytes]) -> None:
    """End a child whose start was interrupted, or whose owner is forgotten."""
    _hang_up(channel)
    end_process(process, 0.0)


def end_process(process: subprocess.Popen[bytes], within: float) -> int:
    """Wait for a process so many seconds, then kill it; return how it ended."""
    with suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
        return process.wait(within)
    process.kill()
    return process.wait()


def how_it_ended(code: int) -> str:
    """Return in words how a process ended."""
    if code == 0:
        return "left"
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"failed (exit code {code})"
