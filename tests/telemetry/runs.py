"""A synthetic run for sinks, and how to read a recording back."""

from __future__ import annotations

import math
import warnings
from datetime import timedelta
from typing import TYPE_CHECKING, cast

import numpy as np

from dcmp_hil.control.model import Model
from dcmp_hil.ipc.ring import Ring
from dcmp_hil.telemetry.block import Block, ReferenceAligner
from dcmp_hil.telemetry.memory_sink import MemorySink
from dcmp_hil.telemetry.rerun.rig_view import RigView
from dcmp_hil.values import (
    UNKNOWN_TRUTH,
    Cycle,
    Estimate,
    Event,
    EventKind,
    LimitData,
    PhaseData,
    Reference,
    Sample,
    Timing,
    Truth,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray
    from rerun.chunk import Chunk

    from dcmp_hil.telemetry.recorder import Sink

T = 1e-3
VIEW = RigView(
    name="synthetic",
    parameters=(("controller.kp_1_s2", "4000"), ("loop.rate_hz", "1000")),
    voltage_limit=10.0,
    simulated=True,
    period=T,
)
EVENTS = (
    Event(0.0, "INFO", EventKind.PHASE, "it settles", PhaseData("settling")),
    Event(0.25, "INFO", EventKind.PHASE, "it engages", PhaseData("engaging")),
    Event(0.5, "INFO", EventKind.PHASE, "it runs", PhaseData("running")),
    Event(0.6, "WARN", EventKind.LIMIT, "12.0 V asked for, 10.0 V allowed", LimitData("voltage")),
    Event(0.9, "INFO", EventKind.END, "amplifier at 0 V"),
)


def at(t: float) -> Reference:
    """Return a sine of 1 rad."""
    return Reference(math.sin(t), math.cos(t), -math.sin(t))


def cycle(k: int) -> Cycle:
    """Make period `k`: clamped for a while, late now and then."""
    t = k * T
    demand = 12.0 * math.sin(3.0 * t)
    sent = max(-10.0, min(10.0, demand))
    lateness = 0.7e-3 if k % 97 == 96 else 20e-6
    period = math.nan if k == 0 else T * (1.0 + 0.05 * math.sin(k))
    return Cycle(
        Sample(t, math.sin(t) + 1e-3, sent),
        Estimate(math.sin(t) + 5e-4, math.cos(t) - 1e-3, 2.0),
        at(t + T),
        demand,
        sent,
        Timing(period, lateness, 55e-6),
    )


def truth(k: int) -> Truth:
    """Return the true state at cycle `k`."""
    return Truth(math.sin(k * T), math.cos(k * T), 2.5)


def blocks(periods: int, *, known: bool = True, rows: int = 100) -> list[Block]:
    """Run `periods` through ring and aligner."""
    ring, aligner = Ring(4096), ReferenceAligner(at, T)
    made = []
    for k in range(periods):
        now, began = aligner.now(cycle(k).sample.t, cycle(k).reference)
        ring.push(cycle(k), truth(k) if known else UNKNOWN_TRUTH, now, began)
        if len(ring) == rows or k == periods - 1:
            made.append(Block(ring.drain(), Model()))
    return made


def feed(sink: Sink, periods: int = 1000, *, known: bool = True) -> dict[str, NDArray[np.float64]]:
    """Show a whole run to `sink`; return its columns."""
    keeper = MemorySink()
    for event in EVENTS:
        sink.event(event)
    for block in blocks(periods, known=known):
        sink.block(block)
        keeper.block(block)
    sink.close()
    return keeper.columns()


def chunks(path: Path) -> Iterator[Chunk]:
    """Yield the chunks of a recording; that it has no footer, which Rerun warns of, is meant."""
    from rerun.chunk import RrdReader

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "RRD file has no footer")
        reader = RrdReader(path)
    yield from reader.stream()


def read_back(path: Path, entity: str) -> dict[str, list[object]]:
    """Return the columns of an entity of a recording, those of its chunks joined; static ones too."""
    table: dict[str, list[object]] = {}
    for chunk in chunks(path):
        if chunk.entity_path == f"/{entity}":
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                table.setdefault(name, []).extend(batch.column(name).to_pylist())
    return table


def periods_of(table: dict[str, list[object]]) -> list[int]:
    """Return the number of the period of each row; the rows are at its sample to the nanosecond."""
    times = [cast("timedelta", time) for time in table["loop_time"] if time is not None]
    found = [round(time / timedelta(seconds=T)) for time in times]
    assert times == [number * timedelta(seconds=T) for number in found]
    return found


def entities(path: Path) -> set[str]:
    """Return the paths of all entities of a recording."""
    return {chunk.entity_path.removeprefix("/") for chunk in chunks(path)}


def values(path: Path, plot: str) -> NDArray[np.float64]:
    """Return the lines of a plot, shape (n, lines)."""
    return np.array(read_back(path, plot)["Scalars:scalars"], dtype=np.float64)
