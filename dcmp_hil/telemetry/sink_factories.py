"""Sinks that are there, and functions that make one where it is to run."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from dcmp_hil.telemetry.dispatcher import Sink
from dcmp_hil.telemetry.further_columns import begin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event

SinkMaker: TypeAlias = Callable[[], Sink]
"""Makes a sink; may raise ConfigError. What the sink lists in its `warnings` becomes events."""


class Deferred:
    """A sink that is made when its run begins: describing a run creates no file.

    Parameters
    ----------
    maker
        Makes it.
    """

    def __init__(self, maker: SinkMaker) -> None:
        self._maker = maker
        self._sink: Sink | None = None
        self._missing: tuple[str, ...] = ()

    @property
    def warnings(self) -> Sequence[str]:
        """Messages about parts that the sink or the run works without."""
        warnings: Sequence[str] = getattr(self._sink, "warnings", self._missing)
        return warnings

    def make(self, further: tuple[str, ...] = ()) -> None:
        """Make the sink; blocks and events before this call are ignored.

        Parameters
        ----------
        further
            Names of the further columns.

        Raises
        ------
        ConfigError
            If its maker does.
        """
        try:
            self._sink = self._maker()
            begin(self._sink, further)
        except ImportError as error:  # a viewer's library that this system lacks ends no run
            self._missing = (f"A sink could not be made, the run goes on without it: {error}",)

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        if self._sink:
            self._sink.block(block)

    def event(self, event: Event) -> None:
        """Process an event."""
        if self._sink:
            self._sink.event(event)

    def close(self) -> None:
        """Close the sink, if it was made."""
        if self._sink:
            self._sink.close()


def deferred(sinks: Sequence[Sink | SinkMaker]) -> list[Sink]:
    """Return sinks, and a `Deferred` in place of each function that makes one."""
    return [one if isinstance(one, Sink) else Deferred(one) for one in sinks]


def begin_all(sinks: Sequence[Sink], further: tuple[str, ...]) -> None:
    """Make the sinks that are deferred, and tell all of them the names of the further columns.

    Raises
    ------
    ConfigError
        If the function that makes one does.
    """
    for sink in sinks:
        if isinstance(sink, Deferred):
            sink.make(further)
        else:
            begin(sink, further)


def sorted_out(sinks: Sequence[Sink | SinkMaker]) -> tuple[list[Sink], list[bytes]]:
    """Return the sinks that run in this process, and pickled what makes one in another."""
    pickled = [b"" if isinstance(one, Sink) else _pickled(one) for one in sinks]
    here = deferred([one for one, data in zip(sinks, pickled, strict=True) if not data])
    return here, [data for data in pickled if data]


def _pickled(maker: SinkMaker) -> bytes:
    """Return nothing where it cannot be, or where another process would not find what it names."""
    try:
        data = pickle.dumps(maker)
    except Exception:  # noqa: BLE001 - a user's object may raise any exception
        return b""
    return b"" if b"__main__" in data else data
