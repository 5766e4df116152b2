"""The control process: listens for this user's changes, checks them, and hands them to the loop.

It leaves as soon as its end of the line to the run is closed, whatever closed it.
"""

from __future__ import annotations

import asyncio
import json
import os
import pickle
import signal
import socket
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import DcmpError
from dcmp_hil.live.knobs import knobs
from dcmp_hil.live.mailbox import APPLIED, LOWERING, SIZE, Mailbox
from dcmp_hil.live.places import peer_of, socket_of
from dcmp_hil.live.settable import changed, doubts
from dcmp_hil.live.state import state_of
from dcmp_hil.telemetry.ring import Ring, capacity_of
from dcmp_hil.telemetry.shared import mapped

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.live.mailbox import Answer

_LONGEST = 1 << 16  # bytes of a request
_ANSWER = 1.0  # s for the loop to take a change
_LOOK = 0.002  # s
_SHOWN = 0.1  # s between two states that are sent to whoever watches


@dataclass(frozen=True, slots=True)
class Setup:
    """What the process needs to know.

    Parameters
    ----------
    rig
        As it runs.
    mailbox, ring
        Descriptors of their memory.
    """

    rig: Rig
    mailbox: int
    ring: int


class Server:
    """Answers requests, a line of JSON each.

    Parameters
    ----------
    setup
        What it works with.
    mailbox
        The way to the loop.
    parent
        Process id of the run.
    """

    def __init__(self, setup: Setup, mailbox: Mailbox, parent: int) -> None:
        self._rig, self._knobs = setup.rig, knobs(setup.rig)
        self._parent = parent
        self._mailbox = mailbox
        size = os.fstat(setup.ring).st_size
        self._ring = Ring(capacity_of(size), mapped(setup.ring, size))
        self._one_at_a_time = asyncio.Lock()
        self._stopping = False
        self._watchers: set[asyncio.StreamWriter] = set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one connection."""
        connection: socket.socket = writer.get_extra_info("socket")
        try:
            if peer_of(connection)[1] != os.getuid():
                return
            while line := await reader.readline():
                await self._answer(json.loads(line), writer)
        except (
            OSError,
            ValueError,
            RecursionError,
            asyncio.CancelledError,
        ):  # gone, no line of JSON, or the run's end, which CPython 3.11 would print as an error
            pass
        finally:
            self._watchers.discard(writer)
            writer.close()

    async def _answer(self, request: Any, writer: asyncio.StreamWriter) -> None:
        do = request.get("do") if isinstance(request, dict) else None
        if do == "watch":
            self._watchers.add(writer)
            await self._watch(writer)
        elif do == "stop":
            await _send(writer, self._stop())
        elif do == "set":
            async with self._one_at_a_time:
                await _send(writer, await self._set(request.get("changes")))
        else:
            await _send(writer, self._state())

    async def _watch(self, writer: asyncio.StreamWriter) -> None:
        while True:
            await _send(writer, self._state())
            await asyncio.sleep(_SHOWN)

    def _state(self) -> dict[str, Any]:
        state = state_of(self._ring.latest(), self._mailbox.phase, self._rig)
        state |= {"pid": self._parent, "stopping": self._stopping, "knobs": self._knobs}
        return state

    def _stop(self) -> dict[str, Any]:
        """Ask for the end as Ctrl-C does, once: a second one would not be an orderly one."""
        if not self._stopping and os.getppid() == self._parent:
            self._stopping = True
            os.kill(self._parent, signal.SIGINT)
        return {"ok": True, "said": "the run ends at 0 V"}

    async def _set(self, overrides: Any) -> dict[str, Any]:
        if not isinstance(overrides, list) or not all(isinstance(one, str) for one in overrides):
            return {"ok": False, "said": "A change is a list of KEY=VALUE."}
        try:
            rig, change = changed(self._rig, overrides)
            if (change.gains, change.tuning, change.reference) == (None, None, None):
                return {"ok": True, "said": change.words, "t": self._ring.newest}
            answer = await self._hand_on(self._mailbox.put(change))
        except DcmpError as error:
            return {"ok": False, "said": str(error)}
        if answer is None:
            return {
                "ok": False,
                "said": f"The run did not take it within {_ANSWER:g} s: it is starting or ending.",
            }
        if answer.what != APPLIED:
            why = "the arm is being lowered" if answer.what == LOWERING else "its events say why"
            return {"ok": False, "said": f"The run did not take it: {why}."}
        doubtful = doubts(self._rig, rig)
        self._rig, self._knobs = rig, knobs(rig)
        said = [f"{change.words}, applied at {answer.t:.3f} s", *(f"warning: {one}" for one in doubtful)]
        return {"ok": True, "said": "\n".join(said), "t": answer.t, "warnings": doubtful}

    async def _hand_on(self, number: int) -> Answer | None:
        for _ in range(round(_ANSWER / _LOOK)):
            if answer := self._mailbox.answer(number):
                return answer
            await asyncio.sleep(_LOOK)
        self._mailbox.withdraw()
        return self._mailbox.answer(number)

    async def say_goodbye(self) -> None:
        """Tell whoever watches how the run ended."""
        ended = {"ended": self._mailbox.last_words or "it died; the device goes to 0 V by itself."}
        for writer in tuple(self._watchers):
            with suppress(OSError):
                await asyncio.wait_for(_send(writer, ended), 0.2)


async def _send(writer: asyncio.StreamWriter, message: dict[str, Any]) -> None:
    writer.write(json.dumps(message).encode() + b"\n")
    await writer.drain()


async def _live(line: socket.socket, server: Server, parent: int) -> None:
    """Serve until the line to the run is closed."""
    path = socket_of(parent)
    path.unlink(missing_ok=True)  # of a process that had our number before
    before = os.umask(0o077)
    listening = await asyncio.start_unix_server(server.serve, path, limit=_LONGEST)
    os.umask(before)
    try:
        await asyncio.get_running_loop().sock_recv(line, 1)
        await server.say_goodbye()
    finally:
        listening.close()
        path.unlink(missing_ok=True)


def main(line: int, setup: int, parent: int) -> None:
    """Serve the run of process `parent`; `line` and `setup` are descriptors."""
    os.lseek(setup, 0, os.SEEK_SET)
    with socket.socket(fileno=line) as connection, open(setup, "rb", closefd=False) as file:
        connection.setblocking(False)
        prepared: Setup = pickle.load(file)  # noqa: S301 - written by our own parent
        mailbox = Mailbox(mapped(prepared.mailbox, SIZE))
        try:
            asyncio.run(_live(connection, Server(prepared, mailbox, parent), parent))
        except (DcmpError, OSError) as error:
            mailbox.tell_end(str(error).rstrip("."))
    os._exit(0)  # connections that are still open would be waited for
