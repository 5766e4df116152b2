"""Figures of a run, and its columns and events if they are kept."""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.ipc.shared_memory import Log
from dcmp_hil.telemetry.signals import columns, names
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.memory_sink import MemorySink
    from dcmp_hil.telemetry.statistics import Statistics

_TROUBLES_MAX, _TEXT_CHARS_MAX = 100, 500  # characters


class SummarySink:
    """A sink of sinks.

    Parameters
    ----------
    statistics
        Makes the summary.
    keeper
        Keeps columns and events; None keeps nothing, and memory stays bounded.

    Attributes
    ----------
    troubles
        Warnings and errors with their time, the first hundred.
    """

    def __init__(self, statistics: Statistics, keeper: MemorySink | SharedMemorySink | None) -> None:
        self.statistics = statistics
        self.keeper = keeper
        self.troubles: list[str] = []

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        self.statistics.block(block)
        if self.keeper:
            self.keeper.block(block)

    def event(self, event: Event) -> None:
        """Process an event; always keep the first warnings and errors."""
        if event.level in {"WARN", "ERROR"} and len(self.troubles) < _TROUBLES_MAX:
            self.troubles.append(f"{event.t:.3f} s: {event.text[:_TEXT_CHARS_MAX]}")
        if self.keeper and event.kind is not EventKind.LINK:  # what they came to is in the result
            self.keeper.event(event)

    def close(self) -> None:
        """Nothing to finish."""

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Return every signal kept, shape (periods,), by column name."""
        return self.keeper.columns() if self.keeper else {}

    def events(self) -> tuple[Event, ...]:
        """Return the events kept."""
        return tuple(self.keeper.events) if self.keeper else ()


class Lengths(NamedTuple):
    """Valid lengths of the files of a SharedMemorySink, bytes."""

    columns: int = 0
    events: int = 0


class SharedMemorySink:
    """A MemorySink whose memory another process shares, and can go on with where this one ended.

    Parameters
    ----------
    files
        For columns and for events, from `reserve`.
    lengths
        What is in them already.
    further
        Names of the run's further columns.
    """

    def __init__(
        self, files: tuple[int, int], lengths: Lengths | None = None, further: tuple[str, ...] = ()
    ) -> None:
        lengths = lengths or Lengths()
        self._names = names(further)
        self._columns, self._events = Log(files[0], lengths.columns), Log(files[1], lengths.events)

    @property
    def lengths(self) -> Lengths:
        """Valid lengths so far."""
        return Lengths(self._columns.length, self._events.length)

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        self._columns.append(np.stack(list(columns(block).values()), axis=1).tobytes())

    def event(self, event: Event) -> None:
        """Process an event."""
        data = pickle.dumps(tuple(event))
        self._events.append(len(data).to_bytes(4, "little") + data)

    def close(self) -> None:
        """Nothing to finish."""

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Return every signal, shape (periods,), by column name."""
        table = np.frombuffer(self._columns.read(), np.float64).reshape(-1, len(self._names))
        return {name: table[:, k].copy() for k, name in enumerate(self._names)} if len(table) else {}

    @property
    def events(self) -> list[Event]:
        """Events of the run, in order."""
        data, place, found = self._events.read(), 0, []
        while place < len(data):
            begin = place + 4
            place = begin + int.from_bytes(data[place:begin], "little")
            found.append(Event(*pickle.loads(data[begin:place])))  # noqa: S301 - written by our own child
        return found
