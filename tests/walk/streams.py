"""Where a command's output may go, and what becomes of the command there."""

from __future__ import annotations

import fcntl
import os
import pty
import signal
import struct
import subprocess
import termios
import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tests.installed import environment

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

PIPED, CLOSED, GONE, FULL, SILENT, LATIN, ASCII, TERMINAL = STREAMS = (
    "piped",
    "closed",
    "reader gone",
    "full disk",
    "all closed",
    "latin-1",
    "ascii",
    "terminal of 80 columns",
)
TAKES_NOTHING = (CLOSED, GONE, FULL, SILENT)
CLASSES = ((PIPED, TERMINAL), TAKES_NOTHING, (LATIN, ASCII))
"""Outputs that are alike: all is read, nothing is, not every character is."""
_ENCODINGS = {
    LATIN: {"PYTHONIOENCODING": "latin-1"},
    ASCII: {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
}
_TIMEOUT_S = 300.0  # s: a computer may be busy
_CLOSING = {CLOSED: ">&-", SILENT: ">&- 2>&-", FULL: ">/dev/full"}


@dataclass(frozen=True)
class Called:
    """A command that ended; on a terminal both streams are in `err`."""

    code: int
    out: str
    err: str


def call(
    command: list[str],
    stream: str,
    folder: Path,
    env: dict[str, str | None],
    until: Callable[[int], bool] | None = None,
) -> Called:
    """Run a command with its output there; Ctrl-C as soon as `until` of its process id says so."""
    chosen = environment(**env, **_ENCODINGS.get(stream, {}))
    if stream == TERMINAL:
        return _on_terminal(command, folder, chosen, until)
    out: int = subprocess.PIPE
    if stream == GONE:
        read, out = os.pipe()
        os.close(read)
    if stream in _CLOSING:
        command = ["bash", "-c", f'exec "$@" {_CLOSING[stream]}', "-", *command]
    with subprocess.Popen(
        command, cwd=folder, env=chosen, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.PIPE
    ) as process:
        if stream == GONE:
            os.close(out)
        _interrupt(process, until)
        printed, said = _collected(process)
    return Called(
        process.returncode, (printed or b"").decode("utf-8", "replace"), said.decode("utf-8", "replace")
    )


def _text(data: bytes) -> str:
    return data.decode("utf-8", "replace")


def _collected(process: subprocess.Popen[bytes]) -> tuple[bytes | None, bytes]:
    try:
        return process.communicate(timeout=_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        raise


def _on_terminal(
    command: list[str], folder: Path, env: dict[str, str], until: Callable[[int], bool] | None
) -> Called:
    ours, theirs = pty.openpty()
    fcntl.ioctl(ours, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    shown: list[bytes] = []
    with subprocess.Popen(
        command,
        cwd=folder,
        env=env | {"TERM": "xterm-256color"},
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
    ) as process:
        os.close(theirs)
        reader = threading.Thread(target=_read, args=(ours, shown))
        reader.start()
        _interrupt(process, until)
        try:
            process.wait(_TIMEOUT_S)
        finally:
            process.kill()
        reader.join(_TIMEOUT_S)
    os.close(ours)
    return Called(process.returncode, "", _text(b"".join(shown)))


def _read(terminal: int, shown: list[bytes]) -> None:
    with suppress(OSError):  # what Linux says when the other end is closed
        while data := os.read(terminal, 65536):
            shown.append(data)


def _interrupt(process: subprocess.Popen[bytes], until: Callable[[int], bool] | None) -> None:
    if until is None:
        return
    waited = threading.Event()
    for _ in range(round(_TIMEOUT_S / 0.1)):
        if process.poll() is not None:
            return
        if until(process.pid):
            process.send_signal(signal.SIGINT)
            return
        waited.wait(0.1)
    process.kill()
    raise TimeoutError(f"{process.args!r} never got under way")
