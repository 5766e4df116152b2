"""From the loop to everybody who looks on: a ring, then blocks to each sink, in line or from a thread."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.telemetry.ring import Ring
from dcmp_hil.values import Event

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.telemetry.block import Aligner, Block
    from dcmp_hil.values import Cycle, Truth

_IN_LINE = 4096  # rows a block in virtual time, where nobody waits
_CAPACITY = 1 << 15  # rows: 3 s at 10 kHz before the thread loses any
_INTERVAL = 0.1  # s between two blocks from the thread
_LAST_BLOCK = 2.0  # s that the end of a run waits for the thread


class Sink(Protocol):
    """Something that wants to see the run."""

    def block(self, block: Block) -> None:
        """Take consecutive periods."""
        ...

    def event(self, event: Event) -> None:
        """Take an event."""
        ...

    def close(self) -> None:
        """Finish; nothing comes after."""
        ...


class Recorder:
    """The loop's side of telemetry: `record` costs a microsecond and never waits.

    Parameters
    ----------
    truth
        Asked once a period for what a simulation knows.
    aligner
        Finds the reference at each sample's own instant.
    sinks
        Who looks on. One that raises is dropped, and an event says so; the run goes on.
    recent
        Cycles kept for the black box.
    in_line
        True in virtual time: blocks are handed on by `record` itself, so that none is ever lost and runs
        repeat to the bit. False: a thread does it, and rows are dropped and counted if it falls behind.
    """

    def __init__(
        self,
        truth: Callable[[], Truth],
        aligner: Aligner,
        sinks: Sequence[Sink],
        *,
        recent: int,
        in_line: bool,
    ) -> None:
        self.recent: deque[Cycle] = deque(maxlen=recent)
        self._ring = Ring(_CAPACITY)
        self._truth = truth
        self._aligner = aligner
        self._sinks = list(sinks)
        self._events: deque[Event] = deque(maxlen=10_000)
        self._untold = 0
        self._in_line = in_line
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="telemetry", daemon=True)
        if not in_line:
            self._thread.start()

    def record(self, cycle: Cycle) -> None:
        """Take one period."""
        self._ring.push(cycle, self._truth())
        self.recent.append(cycle)
        if self._in_line:
            self._untold += 1
            if self._untold == _IN_LINE:
                self._untold = 0
                self._hand_on()

    def event(self, event: Event) -> None:
        """Take an event."""
        self._events.append(event)

    @property
    def t(self) -> float:
        """Device time of the last period, s; 0 before the first."""
        return self.recent[-1].sample.t if self.recent else 0.0

    @property
    def dropped(self) -> int:
        """Rows lost because the sinks were too slow; after `close`, those never handed on as well."""
        return self._ring.dropped + (len(self._ring) if self._done.is_set() else 0)

    def close(self) -> None:
        """Hand on what is left and close the sinks; waits for a stuck sink for 2 s at most."""
        if self._in_line:
            self._finish()
            return
        self._done.set()
        self._thread.join(_LAST_BLOCK)

    def _serve(self) -> None:
        while not self._done.wait(_INTERVAL):
            self._hand_on()
        self._finish()

    def _finish(self) -> None:
        self._hand_on()
        self._hand_on_events()  # a sink that gave up at the last block is news as well
        while self._sinks:  # the last one first, so that those before it hear if it gives up
            self._tell(lambda sink: sink.close(), [self._sinks.pop()])
            self._hand_on_events()

    def _hand_on_events(self) -> None:
        while self._events:
            event = self._events.popleft()
            self._tell(lambda sink, event=event: sink.event(event))  # type: ignore[misc]

    def _hand_on(self) -> None:
        self._hand_on_events()
        rows = self._ring.drain()
        if len(rows):
            block = self._aligner.block(rows)
            self._tell(lambda sink: sink.block(block))

    def _tell(self, call: Callable[[Sink], None], sinks: Sequence[Sink] | None = None) -> None:
        for sink in tuple(self._sinks if sinks is None else sinks):
            try:
                call(sink)
            except Exception as error:  # noqa: BLE001 - whatever a looker-on does, the run goes on
                self._sinks = [other for other in self._sinks if other is not sink]
                self.event(Event(self.t, "WARN", f"{type(sink).__name__} gave up and was dropped: {error}"))
