"""Asking a run: one line of JSON there, one back, each with its time limit."""

from __future__ import annotations

import json
import socket
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError, DcmpError
from dcmp_hil.live.run_sockets import mailbox_of, running, socket_of, unheard
from dcmp_hil.live.stop_command import STOP_TIME_MAX_S, End, Stopped, is_alive, stop_run

if TYPE_CHECKING:
    from collections.abc import Sequence

_ANSWER_TIMEOUT_S = 3.0  # s: a change has a second to be applied in
_STOP_RECEIPT_TIMEOUT_S = 0.15  # s for a command process to say that it has understood STOP
_NO_RUN_ERROR = (
    "No run listens here. Start one with `dcmp-hil run`; --no-control and --fast keep it from listening."
)


def find_run(pid: int | None = None) -> int:
    """Return the process id of the run that is meant.

    Raises
    ------
    ConfigError
        If there is none, or there are several and none was named.
    """
    runs = running() or unheard()  # which take no request but STOP
    if pid is not None and pid not in runs and mailbox_of(pid) is None:
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
    reply = _ask(run, {"do": "set", "changes": list(overrides)}, _ANSWER_TIMEOUT_S)
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
    return _ask(run, {"do": "status"}, _ANSWER_TIMEOUT_S)


def stop(run: int) -> Stopped:
    """End a run, by force where it does not answer; return within a second what became of it.

    Its command process does it. Where that is silent, it is done here, by the memory that the two share.

    Raises
    ------
    ConfigError
        If there is no such run any more.
    """
    with socket.socket(socket.AF_UNIX) as connection, suppress(OSError):
        connection.settimeout(_STOP_RECEIPT_TIMEOUT_S)
        connection.connect(str(socket_of(run)))
        return _exchange_stop(connection)
    mailbox = mailbox_of(run)
    if mailbox is None:
        raise ConfigError(f"The run of process {run} listens no more: it has ended, or does so now.")
    return stop_run(run, mailbox, lambda: is_alive(run), late=_STOP_RECEIPT_TIMEOUT_S)


def stop_found(pid: int | None) -> tuple[int, Stopped] | DcmpError:
    """End the run that is meant; return its process id and what became of it, or what is wrong."""
    try:
        run = find_run(pid)
        return run, stop(run)
    except DcmpError as error:
        return error


def _exchange_stop(connection: socket.socket) -> Stopped:
    """Ask the command process.

    Raises
    ------
    OSError
        If it is silent, leaves, or answers nonsense.
    """
    connection.sendall(json.dumps({"do": "stop"}).encode() + b"\n")
    with connection.makefile("rb") as lines:
        lines.readline()  # that it was understood
        connection.settimeout(STOP_TIME_MAX_S)
        try:
            reply = json.loads(lines.readline())
            return Stopped(End(reply["end"]), str(reply["said"]))
        except (ValueError, KeyError, TypeError):
            raise ConnectionResetError from None


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


def _listed(runs: Sequence[int]) -> str:
    if not runs:
        return _NO_RUN_ERROR
    return f"These listen: {', '.join(map(str, runs))}. Name one with --run PID."
