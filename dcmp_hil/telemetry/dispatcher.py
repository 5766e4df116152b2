"""Dispatch of blocks and events, in order, to each sink; a sink that raises is dropped and reported."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from dcmp_hil.control.model import UNKNOWN_MODEL
from dcmp_hil.telemetry.block import Block
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.control.model import Model

BLOCK_PERIOD_S = 0.1  # s between two blocks in real time
_EVENTS_MAX = 10_000  # events


@runtime_checkable
class Sink(Protocol):
    """Protocol of a receiver of blocks and events."""

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        ...

    def event(self, event: Event) -> None:
        """Process an event."""
        ...

    def close(self) -> None:
        """Finish; nothing comes after."""
        ...


class RowSource(Protocol):
    """Protocol of what rows are drained from: a ring, or batches of rows."""

    further: tuple[str, ...]
    dropped: int
    position: int
    """Number of the next row to read."""

    @property
    def newest(self) -> float:
        """Device time of the newest row, s; 0 before the first."""
        ...

    def __len__(self) -> int:
        """Return the number of rows not read yet."""
        ...

    def drain(self) -> NDArray[np.float64]:
        """Return every row not read yet, oldest first, shape (n, fields)."""
        ...


class SinkDispatcher:
    """Dispatches the rows of a ring and the waiting events to the sinks, when `dispatch` is called.

    Parameters
    ----------
    ring
        Read by this object only; other rings over the same memory may be read elsewhere.
    sinks
        The receivers of blocks and events.
    tell
        Takes the event that a sink gave up; None hands it to the other sinks.
    model
        What the host believes of the plant.
    """

    def __init__(
        self,
        ring: RowSource,
        sinks: Sequence[Sink],
        tell: Callable[[Event], None] | None = None,
        model: Model = UNKNOWN_MODEL,
    ) -> None:
        self.ring = ring
        self._model = model
        self._sinks = list(sinks)
        self._events: deque[Event] = deque(maxlen=_EVENTS_MAX)
        self._report = tell or self._events.append
        self._warned = {id(sink): len(_warnings(sink)) for sink in self._sinks}

    def event(self, event: Event) -> None:
        """Append an event to the queue."""
        self._events.append(event)

    def dispatch(self) -> None:
        """Dispatch the events that wait, then the rows."""
        self._dispatch_events()
        rows = self.ring.drain()
        if len(rows):
            block = Block(rows, self._model, self.ring.further)
            self._tell(lambda sink: sink.block(block))
        self._report_warnings()

    def finish(self) -> None:
        """Dispatch what is left and close the sinks."""
        self.dispatch()
        self._dispatch_events()  # a sink that gave up at the last block is news as well
        while self._sinks:  # the last one first, so that those before it hear if it gives up
            self._tell(lambda sink: sink.close(), [self._sinks.pop()])
            self._dispatch_events()

    def _dispatch_events(self) -> None:
        while self._events:
            event = self._events.popleft()
            self._tell(lambda sink, event=event: sink.event(event))  # type: ignore[misc]

    def _report_warnings(self) -> None:
        """Report new warnings of a sink."""
        for sink in self._sinks:
            warnings = _warnings(sink)
            for sentence in warnings[self._warned[id(sink)] :]:
                self._report(Event(self.ring.newest, "WARN", EventKind.TELEMETRY, sentence))
            self._warned[id(sink)] = len(warnings)

    def _tell(self, call: Callable[[Sink], None], sinks: Sequence[Sink] | None = None) -> None:
        for sink in tuple(self._sinks if sinks is None else sinks):
            try:
                call(sink)
            except Exception as error:  # noqa: BLE001 - after any error of a sink, the run goes on
                self._sinks = [other for other in self._sinks if other is not sink]
                sentence = f"{type(sink).__name__} gave up and was dropped: {error}"
                self._report(Event(self.ring.newest, "WARN", EventKind.TELEMETRY, sentence))


def _warnings(sink: Sink) -> Sequence[str]:
    """Return a sink's own list of what it goes on without, if it has one."""
    warnings: Sequence[str] = getattr(sink, "warnings", ())
    return warnings


class DispatchThread:
    """A thread that dispatches every `interval`, ten times a second by default, until `finish` is called.

    Parameters
    ----------
    audience
        Dispatched by this thread only.
    interval
        s between two times.
    """

    def __init__(self, audience: SinkDispatcher, interval: float = BLOCK_PERIOD_S) -> None:
        self.audience = audience
        self._interval = interval
        self.finishing = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="telemetry", daemon=True)
        self._thread.start()

    def finish(self, within: float) -> bool:
        """Finish; wait for it so many seconds, and tell whether that was enough."""
        self.finishing.set()
        self._thread.join(within)
        return not self._thread.is_alive()

    def _serve(self) -> None:
        while not self.finishing.wait(self._interval):
            self.audience.dispatch()
        self.audience.finish()
