"""Sinks that are there, and functions that make one where it is to run."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from dcmp_hil.telemetry.audience import Sink

if TYPE_CHECKING:
    from collections.abc import Sequence

SinkMaker: TypeAlias = Callable[[], Sink]
"""Makes a sink; may raise ConfigError. What the sink lists in its `warnings` becomes events."""


def make_all(sinks: Sequence[Sink | SinkMaker]) -> tuple[list[Sink], list[str]]:
    """Return sinks, those made that must be, and the warnings of these.

    Raises
    ------
    ConfigError
        If one that makes a sink does.
    """
    made: list[Sink] = []
    warnings: list[str] = []
    for one in sinks:
        if isinstance(one, Sink):
            made.append(one)
            continue
        try:
            made.append(one())
        except ImportError as error:  # a viewer's library that this system lacks ends no run
            warnings.append(f"A sink could not be made, the run goes on without it: {error}")
        else:
            warnings += getattr(made[-1], "warnings", ())
    return made, warnings


def sorted_out(sinks: Sequence[Sink | SinkMaker]) -> tuple[list[Sink], list[str], list[bytes]]:
    """Return the sinks that run in this process, their warnings, and pickled what makes one in another.

    Raises
    ------
    ConfigError
        If one that makes a sink here does.
    """
    pickled = [b"" if isinstance(one, Sink) else _pickled(one) for one in sinks]
    here, warnings = make_all([one for one, data in zip(sinks, pickled, strict=True) if not data])
    return here, warnings, [data for data in pickled if data]


def _pickled(maker: SinkMaker) -> bytes:
    """Return nothing where it cannot be, or where another process would not find what it names."""
    try:
        data = pickle.dumps(maker)
    except Exception:  # noqa: BLE001 - whatever a user's objects raise
        return b""
    return b"" if b"__main__" in data else data
