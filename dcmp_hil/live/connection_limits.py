"""Bounds on who is connected to a run's command process, so that STOP gets through a crowd of connections."""

from __future__ import annotations

import asyncio
import socket
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]

CONNECTIONS_MAX = 128
"""Connections at once; the oldest goes, but for one that waits for its STOP."""
REQUEST_INTERVAL_MIN_S = 0.05  # s
"""Between two requests of one connection, at least."""
REQUEST_TIMEOUT_S = 2.0  # s
"""For the next request of a connection."""
_ACCEPTS_AT_ONCE_MAX = 32  # connections taken from the kernel: fewer than may wait, so that each can speak
_ACCEPT_QUEUE_MAX = 1024  # connections that the kernel keeps meanwhile


class ConnectionPool:
    """The connections there are, oldest first."""

    def __init__(self) -> None:
        self._here: dict[asyncio.StreamWriter, None] = {}

    def admit(self, writer: asyncio.StreamWriter) -> None:
        """Admit a connection; close the oldest if there are too many."""
        if len(self._here) >= CONNECTIONS_MAX:
            oldest = next(iter(self._here))
            self.forget(oldest)
            oldest.transport.abort()
        self._here[writer] = None

    def forget(self, writer: asyncio.StreamWriter) -> None:
        """Count one no more: it is gone, or has asked for STOP and stays."""
        self._here.pop(writer, None)


async def listen(serve: Serve, path: Path, limit: int) -> asyncio.Server:
    """Listen at `path` for lines of at most `limit` bytes."""
    server = await asyncio.start_unix_server(serve, path, limit=limit, backlog=_ACCEPTS_AT_ONCE_MAX)
    for listening in server.sockets:
        with socket.fromfd(listening.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as again:
            again.listen(_ACCEPT_QUEUE_MAX)
    return server
