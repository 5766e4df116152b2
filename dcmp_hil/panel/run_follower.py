"""Keeps up with the run: its newest state, its end, and the next run."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from typing import Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.envelopes import BucketHistory
from dcmp_hil.live.run_sockets import mailbox_of, running, socket_of, unheard
from dcmp_hil.live.state import end_of
from dcmp_hil.live.stop_command import is_alive

_SEARCH_PERIOD_S = 0.5  # s between two looks for a run
_SILENCE_MAX_S = 1.0  # s without a state after which the page says so
_LINE_BYTES_MAX = 1 << 16  # bytes
_UNKNOWN_END = {"ended": "it left without a word; how is not known here.", "at_zero": False}


class Watcher:
    """Follows a run, the newest by default, and keeps its latest state.

    Parameters
    ----------
    pid
        Of the run that is meant; None takes the newest, and the next when it has ended.

    Attributes
    ----------
    state
        What the page is shown. Of a run that has ended it keeps the rest of its last state.
    history
        The last seconds of the run, also after its end.
    run
        Process id of the run that is watched; None while there is none.
    """

    def __init__(self, pid: int | None) -> None:
        self._wanted = pid
        self.run: int | None = None
        self.state: dict[str, Any] = {"connection": "none"}
        self.history = BucketHistory()

    async def watch(self) -> None:
        """Follow one run after the other, until cancelled."""
        while True:
            if self.run is None:
                self.run = await asyncio.to_thread(self._find)
            run = self.run
            if run is not None and (await self._follow(run) or await self._follow_unseen(run)):
                self.run = None
            await asyncio.sleep(_SEARCH_PERIOD_S)

    def _find(self) -> int | None:
        runs = [*_unheard(), *_listening()]  # one that goes on unseen can be stopped
        if self._wanted is not None:
            return self._wanted if self._wanted in runs else None
        return runs[-1] if runs else None

    async def _follow(self, pid: int) -> bool:
        """Follow a run by its command process; return whether that told of the run's end."""
        told = False
        with suppress(OSError, ValueError):
            reader, writer = await asyncio.open_unix_connection(socket_of(pid), limit=_LINE_BYTES_MAX)
            try:
                writer.write(b'{"do": "watch"}\n')
                while line := await self._next_line(reader):
                    state = json.loads(line, parse_constant=lambda _: None)  # of an older version
                    told = told or "ended" in state
                    self._take(state)
            finally:
                writer.close()
        return told

    async def _follow_unseen(self, pid: int) -> bool:
        """Follow a run without its command process, by the memory that they shared; return whether it ended.

        A command process that listens is only slow, or about to be gone: it is asked again.
        """
        mailbox = await asyncio.to_thread(mailbox_of, pid)
        known = self.state
        if known.get("pid") != pid:
            known = {"pid": pid}
            self.history.clear()
        while mailbox is not None and not mailbox.ended and is_alive(pid):
            listens = pid in await asyncio.to_thread(_listening)
            self.state = {**known, "connection": "silent" if listens else "unseen"}
            if listens:
                return False
            await asyncio.sleep(_SEARCH_PERIOD_S)
        end = _UNKNOWN_END if mailbox is None else end_of(mailbox)
        self.state = {**known, **end, "connection": "ended"}
        return True

    def _take(self, state: dict[str, Any]) -> None:
        """Keep a state; the last words of a run are added to the state before."""
        if state.get("pid", self.state.get("pid")) != self.state.get("pid"):
            self.history.clear()
        self.history.add(state.pop("buckets", []))
        if "ended" in state:
            self.state = {**self.state, **state, "connection": "ended"}
        else:
            self.state = {**state, "connection": "live"}

    async def _next_line(self, reader: asyncio.StreamReader) -> bytes:
        """Return the next line; while none comes, the page is told."""
        waiting = asyncio.ensure_future(reader.readline())
        while True:
            done, _ = await asyncio.wait({waiting}, timeout=_SILENCE_MAX_S)
            if done:
                return waiting.result()
            self.state = {**self.state, "connection": "silent"}


def _listening() -> list[int]:
    """Return the runs that listen, oldest first; none where their folder is not this user's own."""
    try:
        return running()
    except ConfigError:
        return []


def _unheard() -> list[int]:
    """Return the runs whose command process is gone, oldest first; none as for `_listening`."""
    try:
        return unheard()
    except ConfigError:
        return []
