"""Asking a run: one line of JSON there, one back, each with its time limit."""

from __future__ import annotations

import json
import os
import signal
import socket
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.places import peer_of, running, socket_of

if TYPE_CHECKING:
    from collections.abc import Sequence

_SLOW = 3.0  # s: a change has a second to be applied in
_STOP = 0.5  # s after which STOP takes the short way
_NONE = "No run listens here. Start one with `dcmp-hil run`; --no-control and --fast keep it from listening."


def find_run(pid: int | None = None) -> int:
    """Return the process id of the run that is meant.

    Raises
    ------
    ConfigError
        If there is none, or there are several and none was named.
    """
    runs = running()
    if pid is not None and pid not in runs:
        raise ConfigError(f"No run of process {pid} listens here. {_listed(runs)}")
    if pid is not None:
        return pid
    if len(runs) != 1:
        raise ConfigError(_listed(runs))
    return runs[0]


def change(run: int, overrides: Sequence[str]) -> str:
    """Change keys of a run; return what was applied, and when.

    Raises
    ------
    ConfigError
        If it was refused, with the reason.
    """
    reply = _ask(run, {"do": "set", "changes": list(overrides)}, _SLOW)
    if not reply.get("ok"):
        raise ConfigError(*str(reply.get("said", "refused")).splitlines())
    return str(reply["said"])


def status(run: int) -> dict[str, Any]:
    """Return the state of a run.

    Raises
    ------
    ConfigError
        If it does not answer.
    """
    return _ask(run, {"do": "status"}, _SLOW)


def stop(run: int) -> None:
    """End a run as Ctrl-C does; where its control process is silent, by the signal itself.

    Raises
    ------
    ConfigError
        If there is no such run any more.
    """
    gone = ConfigError(f"The run of process {run} listens no more: it has ended, or does so now.")
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(_STOP)
        try:
            connection.connect(str(socket_of(run)))
            if _exchange(connection, {"do": "stop"}) is None:
                raise gone
        except TimeoutError:
            _interrupt(run, connection)
        except OSError:
            raise gone from None


def _interrupt(run: int, connection: socket.socket) -> None:
    """Send the signal, if whoever listens is a child of that run: process ids are used again."""
    if _parent_of(peer_of(connection)[0]) == run:
        with suppress(ProcessLookupError):
            os.kill(run, signal.SIGINT)


def _ask(run: int, request: dict[str, Any], patience: float) -> dict[str, Any]:
    """Return the answer.

    Raises
    ------
    ConfigError
        If there is none in time.
    """
    reply = None
    with suppress(OSError), socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(patience)
        connection.connect(str(socket_of(run)))
        reply = _exchange(connection, request)
    if reply is None:
        raise ConfigError(f"The run of process {run} does not answer. `dcmp-hil stop` ends it all the same.")
    return reply


def _exchange(connection: socket.socket, request: dict[str, Any]) -> dict[str, Any] | None:
    """Return the answer; None if the other end closes, or answers nonsense."""
    connection.sendall(json.dumps(request).encode() + b"\n")
    with connection.makefile("rb") as lines:
        try:
            reply = json.loads(lines.readline())
        except ValueError:
            return None
    return reply if isinstance(reply, dict) else None


def _parent_of(pid: int) -> int:
    """Return the parent of a process; 0 if it is gone."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text("utf-8")
    except OSError:
        return 0
    return int(stat.rpartition(")")[2].split()[1])


def _listed(runs: Sequence[int]) -> str:
    if not runs:
        return _NONE
    return f"These listen: {', '.join(map(str, runs))}. Name one with --run PID."
