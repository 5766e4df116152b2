"""Keeps up with the run: its newest state, its end, and the next run."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from typing import Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.envelopes import BucketHistory
from dcmp_hil.live.run_sockets import running, socket_of

_SEARCH_PERIOD_S = 0.5  # s between two looks for a run
_SILENCE_MAX_S = 1.0  # s without a state after which the page says so
_LINE_BYTES_MAX = 1 << 16  # bytes


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
            pid = await asyncio.to_thread(self._find)
            if pid is not None:
                with suppress(OSError, ValueError):
                    await self._follow(pid)
                self.run = None
                if self.state["connection"] != "ended":
                    self.state |= {"connection": "ended", "ended": "its command process is gone."}
            await asyncio.sleep(_SEARCH_PERIOD_S)

    def _find(self) -> int | None:
        try:
            runs = running()
        except ConfigError:
            return None
        if self._wanted is not None:
            return self._wanted if self._wanted in runs else None
        return runs[-1] if runs else None

    async def _follow(self, pid: int) -> None:
        reader, writer = await asyncio.open_unix_connection(socket_of(pid), limit=_LINE_BYTES_MAX)
        self.run = pid
        try:
            writer.write(b'{"do": "watch"}\n')
            while line := await self._next_line(reader):
                self._take(json.loads(line))
        finally:
            writer.close()

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
