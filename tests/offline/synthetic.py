"""Recordings of a simulated pendulum, whose true velocity is known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.control.model import Model
from dcmp_hil.offline import LoggedSignals
from sim_backend.plant import MoreauPlant

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

TICK_S = 1e-4  # s
INERTIA_KG_M2 = 0.16  # kg m2
MODEL = Model()


@dataclass(frozen=True)
class Truth:
    """What was recorded, and what really happened; SI, shape (n,)."""

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    voltage: NDArray[np.float64]  # from the row on, as `--input-at start` reads it
    velocity: NDArray[np.float64]

    def keep(self, rows: NDArray[np.bool_]) -> Truth:
        return Truth(self.time[rows], self.position[rows], self.voltage[rows], self.velocity[rows])

    def recording(self, **changes: object) -> LoggedSignals:
        columns = {"time": self.time, "position": self.position, "input": self.voltage}
        return LoggedSignals(**{"name": "synthetic", "input_kind": "voltage", **columns, **changes})  # type: ignore[arg-type]


def swing(
    *,
    ticks: int = 30,
    jitter: int = 0,
    duration: float = 6.0,
    counts: float | None = 2156.0,
    kicks: float = 0.0,
    seed: int = 1,
) -> Truth:
    """Swing under a held voltage of two sines.

    Parameters
    ----------
    ticks
        Usual step, in ticks of 0.1 ms.
    jitter
        Largest deviation of a step, in ticks.
    counts
        Of the encoder, a revolution; None for none.
    kicks
        V: standard deviation of what is added to the voltage, new in every row.
    """
    random = np.random.default_rng(seed)
    plant = MoreauPlant(MODEL, MODEL, position=0.3, step=TICK_S, steps=1)
    rows: list[tuple[float, float, float, float]] = []
    now, position, velocity = 0, 0.3, 0.0
    while now * TICK_S < duration:
        t = now * TICK_S
        voltage = 1.5 * math.sin(2.0 * t) + 1.5 * math.sin(9.0 * t) + kicks * random.standard_normal()
        rows.append((t, position, voltage, velocity))
        step = ticks + int(random.integers(-jitter, jitter + 1))
        for _ in range(step):
            position, velocity, _w = plant.advance(voltage)
        now += step
    truth = Truth(*np.array(rows, dtype=np.float64).T)
    if counts is None:
        return truth
    lsb = 2.0 * math.pi / counts
    return replace(truth, position=np.asarray(lsb * np.round(truth.position / lsb), dtype=np.float64))


def lose(truth: Truth, share: float, seed: int = 2) -> tuple[Truth, int]:
    """Drop rows at random, never the first or last; return how many."""
    kept = np.random.default_rng(seed).random(len(truth.time)) >= share
    kept[[0, -1]] = True
    return truth.keep(kept), int(np.count_nonzero(~kept))


def write(path: Path, columns: Mapping[str, NDArray[np.float64]], form: str = "%.12g") -> Path:
    """Write columns as a CSV file; return its path."""
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, fmt=form, delimiter=",", header=",".join(columns), comments="")
    return path
