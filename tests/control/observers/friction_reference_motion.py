"""R6 `friction_kalman` once more, from its equations in dense matrices: nothing is shared with the package.

The state is x = (x1, x2, d, f, s) in rad, rad/s, rad/s2, rad/s2, rad/s3. Here are steps 1 and 2, the
prediction, and the predictor; the rest is in friction_reference.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Iterable

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

QS, QF, QV, QR, ZV = 5.0, 1e-3, 3e-6, 1.0, 0.06
PV, CREEP, LEAK, PS = 1e-5, 1e-6, 0.3, 3.0
SATURATION_RAD_S = 0.001  # reference velocity below which the compensated friction is proportional


@dataclass(frozen=True, kw_only=True)
class Arm:
    """What the filter is told: the model, the encoder and the keys of the rig."""

    g: float  # gmL/J, rad/s2
    f0: float  # 1/s
    f1: float  # rad/s2
    q: float  # rad per count
    period: float  # s
    d_noise: float = 0.1  # qd, (rad/s2)2/s
    edge_counts: float = 0.13  # Re, counts
    f1_uncertainty: float = 0.25  # pf, rad/s2


@dataclass(frozen=True)
class Motion:
    """A predicted motion: state, acceleration without friction, direction, and which way it went."""

    x: Vector
    a: float
    sg: float
    stuck: bool
    way: str


def sign(value: float) -> float:
    """Return -1, 0 or 1."""
    return float(np.sign(value))


def predict(x: Vector, dt: float, u: float, arm: Arm) -> Motion:
    """Step 1: the motion over `dt` s under u, with friction that can stop the arm and hold it."""
    x1, x2, d, f, s = (float(value) for value in x)
    d = d + dt * s
    s = s * (1.0 - LEAK * dt)
    a = d - arm.g * float(np.sin(x1 + dt * x2 / 2.0)) + u - arm.f0 * x2

    def moved(x1: float, x2: float) -> Vector:
        return np.array([x1, x2, d, f, s])

    at_rest = x2 == 0.0
    if at_rest and not abs(a) > f:
        return Motion(moved(x1, 0.0), a, 0.0, stuck=True, way="stays at rest")
    sg = sign(a) if at_rest else sign(x2)
    v = x2 + dt * (a - sg * f)
    if at_rest or v * sg > 0.0:
        way = "leaves from rest" if at_rest else "slips"
        return Motion(moved(x1 + dt * (x2 + v) / 2.0, v), a, sg, stuck=False, way=way)
    ts = -x2 / (a - sg * f)
    x1 = x1 + x2 * ts / 2.0
    a = a + arm.f0 * x2
    if not abs(a) > f:
        return Motion(moved(x1, 0.0), a, 0.0, stuck=True, way="stops and sticks")
    sg = sign(a)
    x2 = (dt - ts) * (a - sg * f)
    return Motion(moved(x1 + (dt - ts) * x2 / 2.0, x2), a, sg, stuck=False, way="stops and leaves")


def slip_matrix(motion: Motion, dt: float, arm: Arm) -> Matrix:
    """Return F, the Jacobian of a slipping step, at the predicted state."""
    gc = arm.g * float(np.cos(motion.x[0]))
    jacobian = np.eye(5)
    jacobian[0] = [1.0 - dt * dt / 2.0 * gc, dt, dt * dt / 2.0, -motion.sg * dt * dt / 2.0, 0.0]
    jacobian[1] = [-dt * gc, 1.0 - arm.f0 * dt, dt, -motion.sg * dt, 0.0]
    return jacobian


def leak_matrix(dt: float) -> Matrix:
    """Return the matrix of s *= 1 - leak dt."""
    return np.diag([1.0, 1.0, 1.0, 1.0, 1.0 - LEAK * dt])


def drift_matrix(dt: float) -> Matrix:
    """Return the matrix of d += dt s."""
    drift = np.eye(5)
    drift[2, 4] = dt
    return drift


def spread(p: Matrix, motion: Motion, dt: float, arm: Arm, *, m: float, ms: float) -> Matrix:
    """Step 2: the covariance of the prediction, with m and ms of the previous step."""
    if motion.stuck:
        keep = np.diag([1.0, 0.0, 1.0, 1.0, 1.0])
        p = keep @ p @ keep
        p[1, 1] = PV
        p[0, 0] += CREEP * dt
    else:
        jacobian = slip_matrix(motion, dt, arm)
        p = jacobian @ p @ jacobian.T
        p[1, 1] += QV * dt
    p = leak_matrix(dt) @ p @ leak_matrix(dt).T
    p = drift_matrix(dt) @ p @ drift_matrix(dt).T
    reversing = abs(motion.x[1]) < ZV
    p[2, 2] += arm.d_noise * dt * m + (QR * dt if reversing else 0.0)
    p[3, 3] += QF * dt * (30.0 * m - 29.0 if reversing else 1.0)
    p[4, 4] += QS * dt * ms
    return p


def ahead(x: Vector, commands: Iterable[tuple[float, float]], arm: Arm) -> tuple[float, float, float]:
    """Return x1, x2 and d once the next command acts; `commands` are pairs of a duration in s and u."""
    for dt, u in commands:
        x = predict(x, dt, u, arm).x
    return float(x[0]), float(x[1]), float(x[2])


def compensated(x1p: float, d: float, f: float, reference_velocity: float, arm: Arm) -> float:
    """Return w_c, what the controller compensates, from the predicted position and d."""
    sat = min(max(reference_velocity / SATURATION_RAD_S, -1.0), 1.0)
    return d - arm.g * float(np.sin(x1p)) - f * sat
