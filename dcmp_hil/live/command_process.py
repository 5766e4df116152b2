"""The command process as its run sees it: started before anything is armed, and never waited for."""

from __future__ import annotations

import signal
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from dcmp_hil.ipc.child_process import ChildProcess
from dcmp_hil.ipc.mailbox import MAILBOX_BYTES, Mailbox
from dcmp_hil.ipc.shared_memory import mapped, reserve
from dcmp_hil.live.command_server import CommandSetup
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.stop_request import SIGNALS

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from dcmp_hil.telemetry.summary_sink import SummarySink

_START_TIMEOUT_S = 60.0  # s, a far limit: that it is up is an event, and nothing is armed yet
_POLL_PERIOD_S = 0.1  # s
_EXIT_TIMEOUT_S = 0.5  # s for it to leave in, at the end of a run
_SERVER_MODULE = "dcmp_hil.live.command_server"


class CommandProcess:
    """Lets `dcmp-hil set`, `stop` and `panel` change a run, from a process that shares nothing with the loop.

    It sees to it that STOP and signals end the run, with any code in it.

    Parameters
    ----------
    listen
        Whether others may change the run.
    unattended
        Called in the telemetry process where this process has ended by force; see `CommandInterface`.
    source
        The rig's file, or the name of a shipped rig; for clients that write values into it.

    Attributes
    ----------
    mailbox
        For the loop to look at.
    pid
        Of the process; None while there is none.
    """

    def __init__(
        self,
        *,
        listen: bool = True,
        unattended: Callable[[SummarySink, int, str, str], None] | None = None,
        source: str = "",
    ) -> None:
        self._listen, self.unattended, self._source = listen, unattended, source
        self._file = reserve(self, "mailbox")
        self.mailbox = Mailbox(mapped(self._file, MAILBOX_BYTES))
        self.pid: int | None = None
        self._child: ChildProcess | None = None
        self._closing = False
        self._watch = threading.Thread(target=self._wait, name="command", daemon=True)
        self._warn: Callable[[str], None]

    @property
    def signals(self) -> int:
        """Descriptor that takes the numbers of signals; -1 while there is none."""
        return -1 if self._child is None else self._child.channel.fileno()

    @property
    def file(self) -> int:
        """Descriptor of the mailbox's memory."""
        return self._file

    def open(
        self, rig: Rig, ring: int | None, warn: Callable[[str], None], further: tuple[str, ...] = ()
    ) -> None:
        """Start it; it comes up by itself, in about half a second. See `CommandInterface`."""
        if ring is None:
            return
        self._warn = warn
        try:
            child = ChildProcess(
                _SERVER_MODULE,
                CommandSetup(rig, self._file, ring, self._listen, self._source, further),
                shared=[self._file, ring],
                blocked=SIGNALS,  # until it has handlers of its own
            )
        except OSError as error:
            warn(f"The command process could not be started ({error}): this run cannot be changed.")
            return
        self._child, self.pid = child, child.pid
        self._watch.start()

    def wait_until_up(self, stopped: Callable[[], bool]) -> None:
        """Wait until it listens; not for one that has ended. See `CommandInterface`."""
        clock = MonotonicClock()
        end_ns = clock.now_ns() + int(1e9 * _START_TIMEOUT_S)
        while self._child is not None and self._watch.is_alive() and not stopped():
            if self._child.is_heard(_POLL_PERIOD_S) or clock.now_ns() > end_ns:
                return

    def close(self, last_words: str, end: int) -> None:
        """Report the end of the run to the process, and wait for its end."""
        self._closing = True
        self.mailbox.tell_end(last_words, end)
        if self._child is not None:
            self._child.hang_up()
            if self._watch.is_alive():
                self._watch.join(_EXIT_TIMEOUT_S)
            if self._watch.is_alive():
                self._child.process.kill()
                self._watch.join(_EXIT_TIMEOUT_S)
            else:  # it has ended and was waited for, unless Ctrl-C came before the thread was started
                self._child.end(_EXIT_TIMEOUT_S)

    def _wait(self) -> None:
        """Wait for its end, on a thread that the kernel wakes only then, and that signals get through to."""
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        assert self._child is not None  # noqa: S101 - started after it
        with suppress(OSError):
            code = self._child.process.wait()
            if not self._closing:
                why = self.mailbox.last_words or f"exit code {code}"
                self._warn(
                    f"The command process ended ({why}): `dcmp-hil set`, `stop` and `panel` reach this run "
                    "no more; it goes on, and Ctrl-C ends it."
                )
