"""The telemetry process: drains the ring, feeds the sinks, and ends shortly after its parent.

The sinks that make a run's figures have the main thread; every other one has a thread of its own, so that a
viewer that takes nothing delays no other sink. It leaves by itself when its parent says so, or is gone.
"""

from __future__ import annotations

import os
import pickle
import select
import signal
import socket
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.child_process import MESSAGE_BYTES_MAX
from dcmp_hil.ipc.ring import Ring, size_of
from dcmp_hil.ipc.shared_memory import Ledger, mapped
from dcmp_hil.platform import process_log
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.heap import trim
from dcmp_hil.telemetry.dispatcher import BLOCK_PERIOD_S, DispatchThread, SinkDispatcher
from dcmp_hil.telemetry.further_columns import begin
from dcmp_hil.telemetry.parent_exit import how_it_died
from dcmp_hil.telemetry.rerun.stream_worker import THREAD
from dcmp_hil.telemetry.summary_sink import Lengths, SharedMemorySink, SummarySink
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    from dcmp_hil.control.model import Model
    from dcmp_hil.ipc.child_process import ParentProcess
    from dcmp_hil.telemetry.dispatcher import Sink
    from dcmp_hil.telemetry.statistics import Statistics

UP, FIGURES, DONE = b"up", b"figures", b"done"
_ORDERED_FINISH_TIMEOUT_S = (
    1.0  # s for the other sinks, one after the other; then they need only end some time
)
_CLOSE_TIMEOUT_S = 12.0  # s for all of them; a window that is still opening needs that long
_TRIM_PERIOD_CHECKS = 100  # looks into the ring: 10 s
_ORPHAN_CLOSE_TIMEOUT_S = 1.0  # s for those that are late where the parent is gone: no user looks at a window


@dataclass(frozen=True, slots=True)
class WorkerSetup:
    """Arguments of the child process.

    Parameters
    ----------
    capacity
        Of the ring.
    ring, ledger, kept
        Descriptors: of the ring's memory, of the ledger, of the logs of a SharedMemorySink if there is one.
    statistics
        Not begun.
    sinks
        Functions that make the others, pickled.
    model
        What the host believes of the plant.
    unattended
        A function, pickled, that is called where the run's process has ended by force; nothing for none.
    mailbox
        Descriptor of the memory in which the run says how it ended; None if it does not.
    speed
        How many times faster than real time the rows come.
    further
        Names of the further fields of a row.
    """

    capacity: int
    ring: int
    ledger: int
    kept: tuple[int, int] | None
    statistics: Statistics
    sinks: tuple[bytes, ...]
    model: Model
    unattended: bytes = b""
    mailbox: int | None = None
    speed: float = 1.0
    further: tuple[str, ...] = ()


class WorkerState(NamedTuple):
    """Progress of the process, from which its parent can continue in its place."""

    position: int  # of the ring
    dropped: int  # rows
    events: int  # taken from the parent
    statistics: Statistics
    kept: Lengths
    troubles: list[str]
    slowest: int = 0  # position of the sink that is furthest behind


def main(parent: ParentProcess, terminal: int) -> None:
    """Serve, then leave.

    Parameters
    ----------
    parent
        The run, which gives a WorkerSetup.
    terminal
        Descriptor for the run's own lines; descriptor 2 takes what libraries write.
    """
    process_log.use_terminal(terminal)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # the parent decides
        signal.signal(number, signal.SIG_IGN)
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    with parent.channel:
        _TelemetryWorker(parent.setup, parent).serve()
    if any(thread.name == THREAD for thread in threading.enumerate()):
        sys.stderr.flush()
        os._exit(0)  # Rerun's own ending waits for a frozen viewer for ever


class _TelemetryWorker:
    def __init__(self, setup: WorkerSetup, parent: ParentProcess) -> None:
        self._setup, self._channel, self._parent = setup, parent.channel, parent
        further = setup.further
        self._keeper = SharedMemorySink(setup.kept, further=further) if setup.kept else None
        self._figures = SummarySink(setup.statistics, self._keeper)
        size = size_of(setup.capacity, len(further))
        self._ring = Ring(setup.capacity, mapped(setup.ring, size), further)
        self._audience = SinkDispatcher(self._ring, [self._figures], self._tell, setup.model)
        self._ledger = Ledger(setup.ledger)
        self._services: list[DispatchThread] = []
        self._taken = 0  # events from the parent
        self._looks = 0

    def serve(self) -> None:
        """Make the sinks, say so, and dispatch until the end."""
        try:
            warnings = self._make_sinks()
        except ConfigError as error:
            self._say(pickle.dumps(error.faults))
            return
        self._say(UP)
        for sentence in warnings:
            self._tell(Event(0.0, "WARN", EventKind.TELEMETRY, sentence))
        with select.epoll() as waiting:
            waiting.register(self._channel, select.EPOLLIN)
            while True:
                waiting.poll(BLOCK_PERIOD_S / self._setup.speed)
                ended = self._take_events() or not self._parent.lives
                self._dispatch()
                if ended:
                    break
        self._say(FIGURES)
        end = how_it_died(self._setup.mailbox, self._parent.pid)
        if end:
            self._tell(Event(self._ring.newest, "ERROR", EventKind.END, end.sentence))
        self._close()
        self._dispatch()
        self._say(DONE)
        if end and self._setup.unattended:
            finish = pickle.loads(self._setup.unattended)  # noqa: S301 - written by our own parent
            if finish is not None:
                finish(self._figures, self._ring.dropped, end.word, end.sentence)

    def _make_sinks(self) -> list[str]:
        warnings: list[str] = []
        for data in self._setup.sinks:
            try:
                sink: Sink = pickle.loads(data)()  # noqa: S301 - written by our own parent
                begin(sink, self._setup.further)
            except ConfigError:
                raise
            except Exception as error:  # noqa: BLE001 - after any error of a sink, the run goes on
                warnings.append(f"A sink could not be made: {type(error).__name__}: {error}")
                continue
            warnings += getattr(sink, "warnings", ())
            audience = SinkDispatcher(self._ring.reader(), [sink], self._tell, self._setup.model)
            interval = getattr(sink, "interval", BLOCK_PERIOD_S) / self._setup.speed
            self._services.append(DispatchThread(audience, interval))
        return warnings

    def _tell(self, event: Event) -> None:
        for audience in (self._audience, *(service.audience for service in self._services)):
            audience.event(event)

    def _take_events(self) -> bool:
        """Receive what the parent sent; return whether that was the last."""
        while True:
            try:
                message = self._channel.recv(MESSAGE_BYTES_MAX, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return False
            except OSError:
                return True
            if not message:  # the parent closed its side
                return True
            self._taken += 1
            self._tell(Event(*pickle.loads(message)))  # noqa: S301 - written by our own parent

    def _dispatch(self) -> None:
        self._audience.dispatch()
        self._looks += 1
        if self._looks % _TRIM_PERIOD_CHECKS == 0:
            trim()
        lengths = self._keeper.lengths if self._keeper else Lengths()
        figures, ring = self._figures, self._ring
        self._ledger.write(
            WorkerState(
                ring.position,
                ring.dropped,
                self._taken,
                figures.statistics,
                lengths,
                figures.troubles,
                min((service.audience.ring.position for service in self._services), default=ring.position),
            )
        )

    def _close(self) -> None:
        """Close the other sinks, the last one first; one that takes its time is waited for at the end."""
        clock = MonotonicClock()
        orphaned = not self._parent.lives
        end_ns = clock.now_ns() + int((_ORPHAN_CLOSE_TIMEOUT_S if orphaned else _CLOSE_TIMEOUT_S) * 1e9)
        late = [
            service for service in reversed(self._services) if not service.finish(_ORDERED_FINISH_TIMEOUT_S)
        ]
        for service in late:
            service.finish(max(0, end_ns - clock.now_ns()) * 1e-9)

    def _say(self, message: bytes) -> None:
        with suppress(OSError):  # the parent is gone
            self._channel.send(message)
