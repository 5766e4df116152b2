"""The command process: listens for this user's changes, checks them, and hands them to the loop.

It leaves as soon as its end of the line to the run is closed, for any reason.
"""

from __future__ import annotations

import asyncio
import json
import os
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import DcmpError
from dcmp_hil.ipc.child_process import parent_lives
from dcmp_hil.ipc.mailbox import APPLIED, LOWERING, MAILBOX_BYTES, STOP_REQUEST, Mailbox
from dcmp_hil.ipc.ring import Ring, capacity_of
from dcmp_hil.ipc.run_end import LIVES
from dcmp_hil.ipc.shared_memory import mapped
from dcmp_hil.live.connection_limits import REQUEST_INTERVAL_MIN_S, REQUEST_TIMEOUT_S, ConnectionPool, listen
from dcmp_hil.live.envelopes import BUCKETS_PER_LINE_MAX, COLUMNS, Envelopes
from dcmp_hil.live.run_sockets import peer_of, socket_of
from dcmp_hil.live.run_watch import RunWatch
from dcmp_hil.live.start_values import kept_references, overrides_between, table_overrides, tunable_overrides
from dcmp_hil.live.state import end_of, finite, state_of
from dcmp_hil.live.stop_command import stop_run
from dcmp_hil.live.tunable_ranges import tunable_descriptions
from dcmp_hil.live.tunables import changed, doubts
from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    import socket
    from pathlib import Path

    from dcmp_hil.config import Rig
    from dcmp_hil.ipc.child_process import ParentProcess
    from dcmp_hil.ipc.mailbox import Answer
    from dcmp_hil.live.stop_command import Stopped

_REQUEST_BYTES_MAX = 1 << 16  # bytes of a request
_CHANGE_TIMEOUT_S = 1.0  # s for the loop to take a change
_POLL_PERIOD_S = 0.002  # s
_STATE_PERIOD_S = 0.1  # s between two states that are sent to every watcher
_CHECK_PERIOD_S = 0.05  # s between two looks at the run: whether it lives, and its newest cycle
_LOOKS_PER_INTAKE = 2  # what is drawn of the run is brought up to date as often as it is sent
_MARKS_MAX = 8  # changes that a state names
_STOP_ANSWER_TIMEOUT_S = 0.3  # s for those who asked for STOP to be answered in, after the end


@dataclass(frozen=True, slots=True)
class CommandSetup:
    """Arguments of the child process.

    Parameters
    ----------
    rig
        As it runs.
    mailbox, ring
        Descriptors of their memory.
    listen
        Whether others may change the run; STOP by a signal is seen to in any case.
    source
        The rig's file, an absolute path, or the name of a shipped rig; empty if it has neither.
    further
        Names of the further fields of a row of the ring.
    """

    rig: Rig
    mailbox: int
    ring: int
    listen: bool = True
    source: str = ""
    further: tuple[str, ...] = ()


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

    def __init__(self, setup: CommandSetup, mailbox: Mailbox, parent: int) -> None:
        self._rig = self._started_with = setup.rig
        self._source = setup.source
        self._tunables = self._described()
        self._parent = parent
        self._mailbox = mailbox
        size = os.fstat(setup.ring).st_size
        capacity = capacity_of(size, len(setup.further))
        self._ring = Ring(capacity, mapped(setup.ring, size), setup.further)
        self._one_at_a_time = asyncio.Lock()
        self._clock = MonotonicClock()
        self._written, self._newest_ns = 0, self._clock.now_ns()
        self._stopping: asyncio.Task[Stopped] | None = None
        self._unanswered = 0  # who asked for STOP and has no answer yet
        self._watchers: dict[asyncio.StreamWriter, int] = {}  # and the next bucket of each
        self._envelopes = Envelopes(setup.rig)
        self._marks: deque[tuple[float, str]] = deque(maxlen=_MARKS_MAX)
        self._looks = 0  # at new cycles
        self._over = False  # the last words are sent
        self._connections = ConnectionPool()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer the requests of one client until it disconnects."""
        connection: socket.socket = writer.get_extra_info("socket")
        try:
            if peer_of(connection)[1] != os.getuid():
                return
            self._connections.admit(writer)
            while line := await asyncio.wait_for(reader.readline(), REQUEST_TIMEOUT_S):
                await self._answer(json.loads(line), writer)
                await asyncio.sleep(REQUEST_INTERVAL_MIN_S)
        except (
            OSError,  # a TimeoutError is one
            ValueError,
            RecursionError,
            asyncio.CancelledError,
        ):  # gone, no line of JSON, or the run's end, which CPython 3.11 would print as an error
            pass
        finally:
            self._connections.forget(writer)
            self._watchers.pop(writer, None)
            writer.close()

    async def _answer(self, request: Any, writer: asyncio.StreamWriter) -> None:
        do = request.get("do") if isinstance(request, dict) else None
        if do == "watch":
            self._watchers[writer] = 0
            await self._watch(writer)
        elif do == "stop":
            self._connections.forget(writer)  # it stays until it is answered
            await self._answer_stop(writer)
        elif do == "set":
            async with self._one_at_a_time:
                await _send(writer, await self._set(request.get("changes")))
        else:
            await _send(writer, self.state())

    async def _watch(self, writer: asyncio.StreamWriter) -> None:
        while not self._over:  # behind the last words there is no state any more
            self._watchers[writer], buckets = self._envelopes.history.after(self._watchers[writer])
            await _send(writer, {**self.state(), "columns": COLUMNS, "buckets": buckets})
            if len(buckets) < BUCKETS_PER_LINE_MAX:  # else more of what has been waits
                await asyncio.sleep(_STATE_PERIOD_S)

    def state(self) -> dict[str, Any]:
        """Return where the run stands, and how old that is."""
        age = 1e-9 * (self._clock.now_ns() - self._newest_ns)
        state = state_of(self._ring.latest(), self._mailbox.phase, self._rig, age)
        state |= {"pid": self._parent, "stopping": self._stopping is not None, **self._tunables}
        state |= {"late": self._envelopes.late, "missed": self._ring.dropped}
        return state | {"marks": list(self._marks), "source": self._source}

    def _described(self) -> dict[str, Any]:
        """Return what can be changed, as it is, and the changes that lead back to the start."""
        return {
            "knobs": tunable_descriptions(self._rig),
            "back": overrides_between(self._rig, self._started_with),
            "kept": kept_references(self._rig, self._started_with),
            "values": tunable_overrides(self._rig),
            "tables": table_overrides(self._rig),
        }

    def look(self) -> bool:
        """Take in the newest cycles, and note their age; return whether the run's process is there."""
        written = self._ring.written
        if written != self._written:
            self._written, self._newest_ns = written, self._clock.now_ns()
            if self._looks % _LOOKS_PER_INTAKE == 0:
                self._take_in()
            self._looks += 1
        return parent_lives(self._parent)

    def _take_in(self) -> None:
        """Add the newest cycles to what is drawn of the run; STOP does not depend on it."""
        rows = self._ring.drain()
        with suppress(ArithmeticError, ValueError, TypeError, LookupError):
            self._envelopes.add(rows)

    def stop(self, by: int = STOP_REQUEST) -> asyncio.Task[Stopped]:
        """End the run once, by force if it does not answer."""
        if self._stopping is None:
            self._stopping = asyncio.ensure_future(asyncio.to_thread(self._stop, by))
        return self._stopping

    def _stop(self, by: int) -> Stopped:
        ms = getattr(self._rig.backend, "watchdog_ms", None)
        watchdog = f"within {ms} ms" if ms else ""
        alive = partial(parent_lives, self._parent)
        return stop_run(self._parent, self._mailbox, alive, watchdog=watchdog, by=by)

    async def _answer_stop(self, writer: asyncio.StreamWriter) -> None:
        self._unanswered += 1
        try:
            await _send(writer, {"taken": True})
            stopped = await asyncio.shield(self.stop())
            await _send(writer, {"end": stopped.end, "said": stopped.said})
        finally:
            self._unanswered -= 1

    async def _set(self, overrides: Any) -> dict[str, Any]:
        if not isinstance(overrides, list) or not all(isinstance(one, str) for one in overrides):
            return {"ok": False, "said": "A change is a list of KEY=VALUE."}
        try:
            rig, change = changed(self._rig, overrides)
            if (change.gains, change.tuning, change.reference) == (None, None, None):
                return {"ok": True, "said": change.words, "t": finite(self._ring.newest)}
            answer = await self._dispatch(self._mailbox.put(change))
        except DcmpError as error:
            return {"ok": False, "said": str(error)}
        if answer is None:
            return {
                "ok": False,
                "said": f"The run did not take it within {_CHANGE_TIMEOUT_S:g} s: it is starting or ending.",
            }
        if answer.what != APPLIED:
            why = "the arm is being lowered" if answer.what == LOWERING else "its events say why"
            return {"ok": False, "said": f"The run did not take it: {why}."}
        doubtful = doubts(self._rig, rig)
        self._rig = rig
        self._tunables = self._described()
        self._marks.append((finite(answer.t), change.words))
        said = [f"{change.words}, applied at {answer.t:.3f} s", *(f"warning: {one}" for one in doubtful)]
        return {"ok": True, "said": "\n".join(said), "t": finite(answer.t), "warnings": doubtful}

    async def _dispatch(self, number: int) -> Answer | None:
        for _ in range(round(_CHANGE_TIMEOUT_S / _POLL_PERIOD_S)):
            if answer := self._mailbox.answer(number):
                return answer
            await asyncio.sleep(_POLL_PERIOD_S)
        self._mailbox.withdraw()
        return self._mailbox.answer(number)

    async def say_goodbye(self) -> None:
        """Answer every waiting client, and tell every watcher how the run ended."""
        await asyncio.sleep(
            _CHECK_PERIOD_S
        )  # requests that are on their way, a STOP among them, are read first
        for _ in range(round(_STOP_ANSWER_TIMEOUT_S / _POLL_PERIOD_S)):
            if not self._unanswered:
                break
            await asyncio.sleep(_POLL_PERIOD_S)
        self._over = True
        self._take_in()
        self._envelopes.finish()
        ended = {**end_of(self._mailbox), "late": self._envelopes.late}
        for writer, place in tuple(self._watchers.items()):
            last = {**ended, "columns": COLUMNS, "buckets": self._envelopes.history.newest(place)}
            with suppress(OSError):
                await asyncio.wait_for(_send(writer, last), 0.2)


async def _send(writer: asyncio.StreamWriter, message: dict[str, Any]) -> None:
    writer.write(json.dumps(message, allow_nan=False).encode() + b"\n")
    await writer.drain()


async def _serve(line: socket.socket, server: Server, mailbox: Mailbox, path: Path | None) -> None:
    """Serve at an address, or only see to the end of the run."""
    watch = RunWatch(line, server, mailbox)
    if path is None:
        await watch.until_end()
        return
    _remove(path)  # of a process that had our number before
    before = os.umask(0o077)
    listening = await listen(server.serve, path, _REQUEST_BYTES_MAX)
    os.umask(before)
    try:
        await watch.until_end()
    finally:
        listening.close()
        _remove(path)


def _remove(path: Path) -> None:
    path.unlink(missing_ok=True)


def main(parent: ParentProcess) -> None:
    """Serve the run that started this process, and gives a CommandSetup."""
    with parent.channel as connection:
        connection.setblocking(False)
        setup: CommandSetup = parent.setup
        mailbox = Mailbox(mapped(setup.mailbox, MAILBOX_BYTES))
        try:
            path = socket_of(parent.pid) if setup.listen else None
            asyncio.run(_serve(connection, Server(setup, mailbox, parent.pid), mailbox, path))
        except (DcmpError, OSError) as error:
            mailbox.tell_end(str(error).rstrip("."), LIVES)
    os._exit(0)  # connections that are still open would be waited for
