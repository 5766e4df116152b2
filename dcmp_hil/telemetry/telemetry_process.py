"""Telemetry in a process of its own: the loop shares its interpreter lock with no sink.

The loop writes rows into shared memory, and events into a socket that never blocks. The process writes down
how far it has come ten times a second; where it ends too early, or does not answer, what is left in the ring
is worked out here, so that the figures miss only what was overwritten meanwhile.
"""

from __future__ import annotations

import atexit
import os
import pickle
import socket
import subprocess
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

from dcmp_hil.control.model import UNKNOWN_MODEL
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.child_process import ChildProcess, end_process, how_it_ended
from dcmp_hil.ipc.ring import Ring, size_of
from dcmp_hil.ipc.shared_memory import Ledger, mapped, reserve
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.process_log import terminal_copy
from dcmp_hil.telemetry.dispatcher import SinkDispatcher
from dcmp_hil.telemetry.summary_sink import Lengths, SharedMemorySink, SummarySink
from dcmp_hil.telemetry.telemetry_worker import DONE, FIGURES, UP, WorkerSetup, WorkerState
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.control.model import Model
    from dcmp_hil.telemetry.statistics import Statistics

_CAPACITY_ROWS = 1 << 15  # rows: 3 s at 10 kHz before any is lost
_START_TIMEOUT_S = 600.0  # s, a far limit: that it came up is an event, and nothing is armed yet
_SLOW_START_S = 30.0  # s after which the user is told what is waited for
_SUMMARY_TIMEOUT_S = 1.5  # s that a process which does nothing has for the figures, at the end of a run
_REAP_TIMEOUT_S = 0.2  # s
_POLL_PERIOD_S = 0.1  # s
_END_TIMEOUT_S = 2.0  # s that the end of a run takes at most
_EXIT_TIMEOUT_S = 12.0  # s that the end of this process takes at most, for a window that is still opening
_EVENTS_MAX = 10_000
_EVENT_TEXT_CHARS_MAX = 10_000  # characters of an event's text that are sent
_MALLOC_ENVIRONMENT = {
    "MALLOC_ARENA_MAX": "1",
    "MALLOC_MMAP_THRESHOLD_": "131072",
    "MIMALLOC_PURGE_DELAY": "0",
}
"""One heap for all threads, and large pieces outside it: a heap for each thread holds a third more.

Rerun's allocator gives free pages back at once and not after a second: it holds 7 MB instead of 22 MB.
"""
_WORKER_MODULE = "dcmp_hil.telemetry.telemetry_worker"


class TelemetryProcess:
    """The parent's side.

    Parameters
    ----------
    statistics
        Not begun.
    keep
        Whether to keep columns and events.
    sinks
        Functions that make the other sinks there, pickled.
    warn
        Told, in a sentence, what the run goes on without.
    model
        What the host believes of the plant.
    unattended
        A function, pickled, that the process calls where this one has ended by force; see `Session`.
    mailbox
        Descriptor of the memory in which the run says how it ended.
    speed
        How many times faster than real time the rows come: a soak has hours of them in minutes.
    further
        Names of the further fields of a row.

    Attributes
    ----------
    ring
        For the loop to write to.
    figures
        What the run came to, once closed.
    dropped
        Rows that are in no figure, once closed.
    pid
        Of the process, once open; None if there is none.
    ring_file
        Descriptor of the ring's memory, for other processes that read it.
    """

    def __init__(
        self,
        statistics: Statistics,
        *,
        keep: bool,
        sinks: Sequence[bytes] = (),
        warn: Callable[[str], None] | None = None,
        model: Model = UNKNOWN_MODEL,
        unattended: bytes = b"",
        mailbox: int | None = None,
        speed: float = 1.0,
        further: tuple[str, ...] = (),
    ) -> None:
        self._files = [reserve(self, what) for what in ("ring", "ledger", "columns", "events")]
        ring, ledger, *kept = self._files
        self.ring_file = ring
        self._kept = (kept[0], kept[1]) if keep else None
        self._ledger = Ledger(ledger)
        self._warn_user = warn
        self._told: deque[Event] = deque(maxlen=_EVENTS_MAX)
        self._untold: deque[Event] = deque(maxlen=_EVENTS_MAX)
        self._events = 0  # told or not
        self._child: ChildProcess | None = None
        self.ring = Ring(_CAPACITY_ROWS, mapped(ring, size_of(_CAPACITY_ROWS, len(further))), further)
        self.figures = SummarySink(statistics, self._keeper(Lengths()))
        self.dropped = 0
        self.pid: int | None = None
        self._shared = [*self._files, *(() if mailbox is None else (mailbox,))]
        self._setup = WorkerSetup(
            _CAPACITY_ROWS,
            ring,
            ledger,
            self._kept,
            statistics,
            tuple(sinks),
            model,
            unattended,
            mailbox,
            speed,
            further,
        )
        self._model = model

    def open(self, stopped: Callable[[], bool] = lambda: False) -> None:
        """Start the process and wait until its sinks are made, or it ends, or `stopped` says so.

        Raises
        ------
        ConfigError
            If a sink raises it.
        """
        try:
            child = self._start()
        except OSError as error:
            self._go_without(f"could not be started ({error})")
            return
        try:
            answer = self._wait_until_up(child, stopped)
            if answer == UP:
                self._child, self.pid = child, child.pid
                self._send_events()
                return
        finally:
            if self._child is None:  # also where Ctrl-C interrupts the wait
                child.hang_up()
                child.end(0.0)
        if answer:
            raise ConfigError(*pickle.loads(answer))  # noqa: S301 - written by our own child
        if not stopped():
            self._go_without("did not come up")

    @property
    def behind(self) -> int:
        """Rows that the slowest sink has not taken, as the process last said; 0 before it says so."""
        state: WorkerState | None = self._ledger.read()
        return self.ring.written - min(state.position, state.slowest) if state else 0

    def event(self, event: Event) -> None:
        """Send an event, or keep it until there is room; never blocks."""
        self._events += 1
        self._told.append(event)
        self._untold.append(event)
        self._send_events()

    def close(self) -> None:
        """Finish the figures and close the sinks, within 2 s; take over what the process cannot do."""
        sentence = ""
        if self._child:
            try:
                sentence = self._finish(self._child)
            finally:
                self._child.hang_up()
            self._child = None
        self._take_over()
        if sentence:
            lost = f"{self.dropped} periods are in no figure" if self.dropped else "the figures are complete"
            self._warn(
                self.figures.event, f"The telemetry process {sentence}: {lost}; what it recorded ends early."
            )

    # ---------------------------------------------------------------- the process

    def _wait_until_up(self, child: ChildProcess, stopped: Callable[[], bool]) -> bytes:
        """Return the first message; nothing if the process ended, was not waited for, or takes minutes."""
        clock = MonotonicClock()
        began_ns, told = clock.now_ns(), False
        while not stopped() and (waited := 1e-9 * (clock.now_ns() - began_ns)) < _START_TIMEOUT_S:
            if child.is_heard(min(_POLL_PERIOD_S, _START_TIMEOUT_S)):
                return child.receive(_POLL_PERIOD_S)
            if waited > _SLOW_START_S and not told and self._warn_user:
                told = True
                self._warn_user(
                    f"The telemetry process is still starting after {_SLOW_START_S:g} s; Ctrl-C ends this."
                )
        return b""

    def _start(self) -> ChildProcess:
        with terminal_copy() as terminal:
            return ChildProcess(
                _WORKER_MODULE,
                self._setup,
                shared=self._shared,
                arguments=[terminal],
                kind=socket.SOCK_SEQPACKET,
                environment={**_MALLOC_ENVIRONMENT, **os.environ},
            )

    def _finish(self, child: ChildProcess) -> str:
        """Wait until the process ends; return the error message, empty if there is none."""
        clock = MonotonicClock()
        end_ns = clock.now_ns() + int(_END_TIMEOUT_S * 1e9)
        self._send_events()
        child.say_no_more()
        if child.receive_from_working(_SUMMARY_TIMEOUT_S) != FIGURES:
            with suppress(subprocess.TimeoutExpired):  # if its end is closed, the process has ended already
                return how_it_ended(child.process.wait(_REAP_TIMEOUT_S))
            child.end(0.0)
            return f"did not answer for {_SUMMARY_TIMEOUT_S} s"
        if child.receive(max(0, end_ns - clock.now_ns()) * 1e-9) != DONE:
            if (code := child.process.poll()) is not None:
                return how_it_ended(code)
            # a window that is still opening, or a disk that is slow
            atexit.register(end_process, child.process, _EXIT_TIMEOUT_S)
            return ""
        child.end(_END_TIMEOUT_S)
        return ""

    def _send_events(self) -> None:
        while self._untold and self._child:
            event = self._untold[0]
            message = pickle.dumps(tuple(event._replace(text=event.text[:_EVENT_TEXT_CHARS_MAX])))
            try:
                self._child.channel.send(message, socket.MSG_DONTWAIT)
            except OSError:  # no room, or no reader: what is not read is taken over at the end
                return
            self._untold.popleft()

    # ---------------------------------------------------------------- without it

    def _take_over(self) -> None:
        """Continue from the last state that the process wrote: at the very end, if all is well."""
        state: WorkerState = self._ledger.read() or WorkerState(
            0, 0, 0, self.figures.statistics, Lengths(), []
        )
        self.figures = SummarySink(state.statistics, self._keeper(state.kept))
        self.figures.troubles += state.troubles
        ring = self.ring.reader()
        ring.position, ring.dropped = state.position, state.dropped
        audience = SinkDispatcher(ring, [self.figures], model=self._model)
        missing = min(self._events - state.events, len(self._told))
        for event in list(self._told)[len(self._told) - missing :]:
            audience.event(event)
        audience.dispatch()
        self.dropped = ring.dropped

    def _keeper(self, lengths: Lengths) -> SharedMemorySink | None:
        """Return what keeps columns and events, behind what is kept already; None if nothing does."""
        return SharedMemorySink(self._kept, lengths, self.ring.further) if self._kept else None

    def _go_without(self, why: str) -> None:
        self._warn(
            self.event,
            f"The telemetry process {why}: no viewer, no recording, no status line, and figures of the last "
            f"{_CAPACITY_ROWS} periods only; the run goes on.",
        )

    def _warn(self, take: Callable[[Event], None], sentence: str) -> None:
        take(Event(self.ring.newest, "WARN", EventKind.TELEMETRY, sentence))
        if self._warn_user:
            self._warn_user(sentence)
