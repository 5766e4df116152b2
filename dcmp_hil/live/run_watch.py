"""The command process follows its run: whether it lives, and which signals it received."""

from __future__ import annotations

import asyncio
import signal
from contextlib import suppress
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.platform.stop_request import SIGNALS, TAKEN_FLAG

if TYPE_CHECKING:
    import socket

    from dcmp_hil.ipc.mailbox import Mailbox

_CHECK_PERIOD_S = 0.05  # s between two looks at the run: whether it lives, and its newest cycle
_SIGNAL_CHECK_ROUNDS = 4  # rounds between two looks of the loop at its signal handlers
_STARTED_MESSAGE = b"u"
_SIGNALS_BYTES_MAX = 1 << 10  # of signals, that are taken at once


class Served(Protocol):
    """The part of the server that follows the run."""

    def look(self) -> bool:
        """Read the run's newest cycle; return whether the run's process lives."""

    def stop(self, by: int = ..., /) -> object:
        """Have the run end, once."""

    async def say_goodbye(self) -> None:
        """Answer every client that waits."""


class RunWatch:
    """Looks after a run: whether it lives, which signals it was sent, and that its handlers stay in place."""

    def __init__(self, line: socket.socket, server: Served, mailbox: Mailbox) -> None:
        self._line, self._server, self._mailbox = line, server, mailbox
        self._closed = asyncio.Event()

    async def until_end(self) -> None:
        """Return when the run has ended, or its process has, and who waited for that knows."""
        loop = asyncio.get_running_loop()
        loop.add_reader(self._line, self._take)
        for number in SIGNALS:  # a terminal sends them to both
            loop.add_signal_handler(number, self._server.stop, number)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        with suppress(OSError):
            self._line.send(_STARTED_MESSAGE)
        rounds = 0
        while self._server.look() and not self._closed.is_set() and not self._mailbox.ended:
            rounds += 1
            if rounds % _SIGNAL_CHECK_ROUNDS == 0:
                self._mailbox.ask_handlers()
            with suppress(TimeoutError):
                await asyncio.wait_for(self._closed.wait(), _CHECK_PERIOD_S)
        await self._server.say_goodbye()

    def _take(self) -> None:
        """Read the numbers of the signals that the run received."""
        try:
            numbers = self._line.recv(_SIGNALS_BYTES_MAX)
        except BlockingIOError:
            return
        except OSError:
            numbers = b""
        if not numbers:  # the run has closed its end
            asyncio.get_running_loop().remove_reader(self._line)
            self._closed.set()
        for number in numbers:
            if number & ~TAKEN_FLAG in SIGNALS:
                _ = self._server.stop(number & ~TAKEN_FLAG)
            if number & TAKEN_FLAG:
                self._mailbox.tell_taken()
