"""An interruption at a chosen step of some code, and what child processes have left of themselves."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.ipc import shared_memory

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType, ModuleType

    import pytest


def is_interrupted(start: Callable[[], object], step: int, module: ModuleType, kind: str = "opcode") -> bool:
    """Call `start`, and raise `KeyboardInterrupt` at one of its steps, as the handler of a signal does.

    Parameters
    ----------
    start
        What is interrupted.
    step
        Counted from 1, in this thread.
    module
        Its code is interrupted, and not what it calls elsewhere.
    kind
        Of the steps: "line", or "opcode" for the single instructions of Python.

    Returns
    -------
    bool
        False where there are fewer steps, and `start` has returned.
    """
    left = step

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal left
        if frame.f_code.co_filename != module.__file__:
            return None
        frame.f_trace_opcodes = kind == "opcode"
        if event == kind:
            left -= 1
            if not left:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys._getframe().f_trace_opcodes = kind == "opcode"  # noqa: SLF001 - Python 3.12 asks this when tracing begins
    sys.settrace(trace)
    try:
        start()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


class Made:
    """What `ChildProcess` makes: processes, and files by their numbers in the kernel."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.processes: list[subprocess.Popen[bytes]] = []
        self._files: set[tuple[int, int]] = set()
        pair, reserve, made = socket.socketpair, shared_memory.reserve, self

        class Noted(subprocess.Popen[bytes]):
            def __init__(self, *arguments: Any, **keywords: Any) -> None:
                made.processes.append(self)
                super().__init__(*arguments, **keywords)

        def noted_pair(*arguments: Any) -> tuple[socket.socket, socket.socket]:
            both = pair(*arguments)
            self._files |= {_identity(end.fileno()) for end in both}
            return both

        def noted_reserve(owner: object, what: str) -> int:
            file = reserve(owner, what)
            self._files.add(_identity(file))
            return file

        monkeypatch.setattr(subprocess, "Popen", Noted)
        monkeypatch.setattr(socket, "socketpair", noted_pair)
        monkeypatch.setattr("dcmp_hil.ipc.child_process.reserve", noted_reserve)

    @property
    def files(self) -> int:
        """Number of files that were made."""
        return len(self._files)

    @property
    def running(self) -> list[int]:
        """Processes that were started, and were not ended and waited for."""
        return [made.pid for made in self.processes if hasattr(made, "pid") and made.returncode is None]

    @property
    def open_files(self) -> set[tuple[int, int]]:
        """Those of the files that this process has open."""
        found = set()
        for entry in Path("/proc/self/fd").iterdir():
            with suppress(OSError):  # another thread has closed it meanwhile
                found.add(_identity(int(entry.name)))
        return found & self._files


def _identity(file: int) -> tuple[int, int]:
    status = os.fstat(file)
    return status.st_dev, status.st_ino
