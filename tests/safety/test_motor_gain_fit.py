"""The fit of the motor's gain: what least squares by matrices gives, on random rigs."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from dcmp_hil.safety.diagnosis import moved_by
from dcmp_hil.safety.motor_gain_fit import MotorGainFit

Array = np.ndarray[Any, np.dtype[np.float64]]
T = 1e-3


def _pushed(rng: random.Random, ku: float, gravity: float, count: float) -> Array:
    """Return time, way and voltage of a push up and a push down, each 0.1 s, of a random rig."""
    push, gain, friction = (
        15.0 / ku * rng.uniform(0.5, 2.0),
        rng.uniform(0.1, 8.0) * ku,
        rng.uniform(0.0, 8.0),
    )
    slew = push / T if rng.random() < 0.5 else 10.0 ** rng.uniform(1.0, 3.0)
    seen, x, v, applied = [(0.0, 0.0, 0.0)], 0.0, 0.0, 0.0
    for k in range(1, 201):
        wanted = push if k <= 100 else -push
        applied = max(applied - slew * T, min(applied + slew * T, wanted))
        v += T * (gain * applied - gravity * math.sin(x))
        v = math.copysign(max(0.0, abs(v) - T * friction), v)
        x += T * v
        seen.append((k * T, count * round(x / count) if count else x, applied))
    return np.array(seen)


def _by_matrices(seen: Array, ku: float, gravity: float, count: float) -> tuple[float, float]:
    out = int(np.flatnonzero(np.abs(seen[:, 1]) == np.abs(seen[:, 1]).max())[-1]) + 1
    t, moved, applied = seen[:out].T
    columns = np.column_stack([np.ones_like(t), 0.5 * t * t, moved_by(t, applied)])
    noise = math.hypot(0.4 * count, 1e-4)
    usual = np.array([max(count, 1e-4), 2.0, 3.0 * ku])
    covariance = np.linalg.inv(columns.T @ columns / noise**2 + np.diag(usual**-2))
    moved = moved + moved_by(t, gravity * np.sin(moved))
    return float((covariance @ columns.T @ moved)[2] / noise**2), math.sqrt(covariance[2, 2])


def test_fit_is_least_squares() -> None:
    rng = random.Random(1)
    for _ in range(200):
        ku, gravity = 10.0 ** rng.uniform(-1.0, 2.0), rng.choice([0.0, 14.03, 60.0])
        count = rng.choice([0.0, math.tau / 65536, math.tau / 4096, math.tau / 1000])
        seen = _pushed(rng, ku, gravity, count)
        fit = MotorGainFit(ku, gravity, count)
        for t, moved, applied in seen.tolist():
            fit.add(t, moved, applied)
        assert fit.farthest == np.abs(seen[:, 1]).max()
        assert fit.gain() == pytest.approx(_by_matrices(seen, ku, gravity, count), rel=1e-9, abs=0.0)


def test_only_the_way_out_counts() -> None:
    fit = MotorGainFit(5.4, 0.0, 0.0)
    for t, moved in ((0.0, 0.0), (0.1, 0.02), (0.2, 0.02)):
        fit.add(t, moved, 1.0)
    found = fit.gain()
    fit.add(0.3, 0.01, -1.0)
    assert fit.gain() == found
    fit.add(0.4, -0.02, -1.0)
    assert fit.gain() != found


def test_nothing_is_learnt_of_what_is_too_large() -> None:
    for t, voltage in ((1e100, 1.0), (0.1, 1e300), (1e10, 1.0)):
        fit = MotorGainFit(5.4, 14.03, 0.0)
        fit.add(0.0, 0.0, 0.0)
        fit.add(t, 0.01, voltage)
        assert fit.gain() == pytest.approx((0.0, 16.2))
