"""Real runs that listen, in a folder of the test's own."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.client import status
from dcmp_hil.live.run_sockets import peer_of, socket_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import pytest

_MAIN = "from dcmp_hil.cli import main\nmain()"
TIMEOUT_S = 60.0  # s: generous, these machines are shared


@contextmanager
def own_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Keep sockets where no other run's are; the name is short, for a socket's may have 107 characters."""
    with tempfile.TemporaryDirectory(prefix="dcmp", dir="/tmp") as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        yield Path(folder)


@contextmanager
def started(folder: Path, *arguments: str, first: int = 9876) -> Iterator[subprocess.Popen[str]]:
    """Start `dcmp-hil` with arguments; it is ended with the context, if it has not ended by itself.

    `first` is the first of the ports on which recordings are served, and looked for.
    """
    ports = f"viewer.VIEWER_PORT = {first}; viewer.served.__defaults__ = ({first},)"
    process = subprocess.Popen(
        [sys.executable, "-c", f"from dcmp_hil.telemetry.rerun import viewer\n{ports}\n{_MAIN}", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate(timeout=TIMEOUT_S)


def until(done: Callable[[], object], what: str, within: float = TIMEOUT_S) -> None:
    """Wait until something is true."""
    deadline = time.monotonic() + within
    while not done():
        assert time.monotonic() < deadline, f"never: {what}"
        time.sleep(0.02)


def until_running(process: subprocess.Popen[str]) -> None:
    """Wait until a run has full authority."""
    until(lambda: process.poll() is not None or runs(process.pid), "the run got under way")
    assert process.poll() is None, process.communicate()[1]


def command_process_of(pid: int) -> int:
    """Return the command process of a run."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(str(socket_of(pid)))
        return peer_of(connection)[0]


def runs(pid: int) -> bool:
    """Tell whether a run has full authority."""
    try:
        return bool(status(pid).get("phase") == "running")
    except ConfigError:
        return False
