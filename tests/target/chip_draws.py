"""Rigs and rows for the jobs of tests/target/chip, drawn: ordinary ones, extreme ones, and random bits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import STEP_TOLERANCE_PERIODS, ObserverContext
from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
from dcmp_hil.control.observers.super_twisting import tune
from dcmp_hil.control.predictor import held_input
from tests.target.chip_image import ROW, Order, Rows, cycle_setup
from tests.target.chip_rigs import RIGS, parameters

if TYPE_CHECKING:
    import ctypes
    from collections.abc import Iterator

Draw = np.random.Generator

ROWS = 4000
"""Of an order."""
PERIODS = (1e-3, 2e-3, 2e-4, 1e-4)  # s
COUNTS = (4096.0, 500.0, 65536.0, None)
KINDS = ("ordinary", "ordinary", "ordinary", "extreme", "bits")
LIMIT = 10.0  # V
NUMBERS = ("position", "voltage", "x", "v", "a", "x_middle", "v_middle")
_STRANGE = np.array(
    [math.nan, math.inf, -math.inf, 1e-45, -1e-40, 1.1754942e-38, 3.4e38, -3.4e38, -0.0, 0.0], np.float32
)


def context(draw: Draw) -> ObserverContext:
    """Return the facts of a rig."""
    model = Model(f0=float(draw.uniform(0.0, 2.0)), ku=float(draw.uniform(1.0, 20.0)))
    return ObserverContext(model, float(draw.choice(PERIODS)), COUNTS[draw.integers(len(COUNTS))])


def r1_setup(rig: ObserverContext, draw: Draw) -> bytes:
    """Return the numbers of struct r1_job_setup."""
    M = None if draw.random() < 0.5 else float(10.0 ** draw.uniform(-3.0, 3.0))
    mu0 = None if draw.random() < 0.5 else float(draw.uniform(0.0, 0.3 / rig.period))
    tuning, model = tune(rig, L1=4.9, L2=5.51, M=M, mu0=mu0), rig.model
    cube = tuning.mu0 * tuning.mu0 * tuning.mu0
    floor_from = tuning.M / cube if cube > 0.0 else math.inf
    numbers = [model.ku, 4.9, 5.51 + model.f0 * 4.9, 4.9 + model.f0, tuning.M, tuning.mu0, floor_from]
    for step in (tuning.nominal, *tuning.gaps.values()):
        numbers += step
    numbers += [rig.period, STEP_TOLERANCE_PERIODS * rig.period, *held_input(model.f0, rig.period), model.ku]
    numbers += [4000.0, 130.0, 1.0, model.f0, 1.0 / model.ku, model.f1]
    numbers += [LIMIT, float(draw.choice([math.inf, 0.5])), float(draw.choice([0.0, 0.01]))]
    return np.array(numbers, np.float32).tobytes()


def friction_setup(rig: ObserverContext, draw: Draw) -> bytes:
    """Return the numbers of struct dcmp_friction_setup."""
    encoder = rig._replace(counts_per_rev=rig.counts_per_rev or COUNTS[0])
    noise, edge = 10.0 ** draw.uniform(-3.0, 1.0), draw.uniform(0.02, 0.5)
    constants = FrictionKalman(encoder, d_noise=noise, edge_counts=edge).constants
    return np.array(constants, np.float32).tobytes()


def _clock(rows: Rows, period: float, draw: Draw) -> Any:
    """Set ticks and gaps, some samples lost; return the time, s."""
    gaps = np.where(draw.random(len(rows)) < 0.03, draw.integers(0, 13, len(rows)), 1)
    rows["tick"] = np.cumsum(gaps)
    rows["gap"] = gaps * period
    odd = draw.random(len(rows)) < 0.002
    rows["gap"][odd] = draw.choice(
        [0.5 * period, -period, math.nan, math.inf, 1.015 * period, 0.0], odd.sum()
    )
    return rows["tick"] * period


def _ordinary(rows: Rows, rig: ObserverContext, draw: Draw) -> None:
    t = _clock(rows, rig.period, draw)
    rate, size = draw.uniform(0.3, 6.0), draw.uniform(0.01, 3.0)
    position = size * np.sin(rate * t) + 0.3 * size * np.sin(3.1 * rate * t + 1.0)
    if rig.counts_per_rev:
        count = 2.0 * math.pi / rig.counts_per_rev
        position = np.round(position / count) * count
    rows["position"] = position
    rows["voltage"] = np.clip(
        LIMIT * 1.5 * np.sin(2.0 * rate * t) + draw.normal(0.0, 0.2, len(t)), -LIMIT, LIMIT
    )
    for name, ahead in (("", rig.period), ("_middle", -0.5 * rig.period)):
        rows[f"x{name}"] = size * np.sin(rate * (t + ahead))
        rows[f"v{name}"] = size * rate * np.cos(rate * (t + ahead))
    rows["a"] = -rate * rate * rows["x"]
    for name in NUMBERS:
        strange = np.flatnonzero(draw.random(len(t)) < 0.0005)
        rows[name][strange] = draw.choice(_STRANGE, len(strange))
        rows["restarts"][np.minimum(strange + draw.integers(1, 30, len(strange)), len(t) - 1)] = 1


def _extreme(rows: Rows, rig: ObserverContext, draw: Draw) -> None:
    """Set numbers from the smallest that there are to the largest."""
    _clock(rows, rig.period, draw)
    block = np.arange(len(rows)) // 50
    with np.errstate(over="ignore", under="ignore"):
        for name in NUMBERS:
            scale = 10.0 ** draw.uniform(-45.0, 39.0, block[-1] + 1)
            rows[name] = (draw.normal(0.0, 1.0, len(rows)) * scale[block]).astype(np.float32)
    rows["restarts"] = draw.random(len(rows)) < 0.05


def _bits(rows: Rows, rig: ObserverContext, draw: Draw) -> None:
    _clock(rows, rig.period, draw)
    for name in NUMBERS:
        rows[name] = draw.integers(0, 2**32, len(rows), np.uint32).view(np.float32)
    rows["restarts"] = draw.random(len(rows)) < 0.3


def draw_rows(kind: str, rig: ObserverContext, draw: Draw, n: int = ROWS) -> Rows:
    """Return rows of one kind."""
    rows = np.zeros(n, ROW)
    {"ordinary": _ordinary, "extreme": _extreme, "bits": _bits}[kind](rows, rig, draw)
    return rows


def orders(job: str, samples: int, text: str) -> Iterator[Order]:
    """Return orders of observers with so many rows together, drawn by a text."""
    draw = np.random.default_rng([*text.encode(), *job.encode()])
    setup_of = {"r1": r1_setup, "friction": friction_setup}[job]
    for k, rows in enumerate(_sizes(samples)):
        rig = context(draw)
        drawn = draw_rows(KINDS[k % len(KINDS)], rig, draw, rows)
        yield Order(job, setup_of(rig, draw), drawn)


def cycle_orders(library: ctypes.CDLL, samples: int, text: str) -> Iterator[Order]:
    """Return orders of whole cycles."""
    draw = np.random.default_rng([*text.encode(), *b"cycle"])
    for k, rows in enumerate(_sizes(samples)):
        told = parameters(RIGS[k % len(RIGS)])
        rig = ObserverContext(Model(), float(told["period"][0]), COUNTS[0])
        drawn = draw_rows(KINDS[draw.integers(len(KINDS))], rig, draw, rows)
        yield Order("cycle", cycle_setup(library, told), drawn)


def _sizes(samples: int) -> Iterator[int]:
    for first in range(0, samples, ROWS):
        yield min(ROWS, samples - first)
