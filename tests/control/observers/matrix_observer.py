"""R1 and its gains once more, from matrices and scipy alone: nothing here is shared with the package."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Matrix = NDArray[np.float64]
L1, L2, KU = 4.9, 5.51, 5.4  # 1/s, 1/s2 (eq. 14); (rad/s2)/V (eq. 12)
POLES = np.roots([1.0, 2.0, 1.5 * np.sqrt(2.0), 1.1])  # theory.md, R1 step 5, in units of mu


def copy_step(
    dt: float, f0: float, gain1: float = L1, gain2: float = L2
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Return F, Gu, H0, H1 of eq. (6) over `dt` s: u held, y linear between the samples."""
    m5 = np.array(
        [
            [-gain1, 1.0, 0.0, gain1, 0.0],
            [-gain2, -f0, 1.0, gain2, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 0.0, 0.0],
        ]
    )
    e = np.asarray(expm(dt * m5), np.float64)
    h1 = e[:2, 4] / dt
    return e[:2, :2], e[:2, 2], e[:2, 3] - h1, h1


def taylor(dt: float) -> Matrix:
    """Return Phi, the triple integrator over `dt` s."""
    return np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])


def gains(x: float) -> Matrix:
    """Place the poles of (I - k C) Phi at exp(p_i x) by Ackermann's formula, in units of T = 1."""
    phi, c = taylor(1.0), np.array([1.0, 0.0, 0.0])
    wanted = np.poly(np.exp(POLES * min(x, 50.0))).real
    q = sum(w * np.linalg.matrix_power(phi, 3 - i) for i, w in enumerate(wanted))
    observability = np.array([c @ np.linalg.matrix_power(phi, i) for i in (1, 2, 3)])
    return np.asarray(q @ np.linalg.solve(observability, np.array([0.0, 0.0, 1.0])), np.float64)


class MatrixObserver:
    """R1 in five states, every step computed from scratch."""

    def __init__(self, *, f0: float, M: float, mu0: float) -> None:
        self.f0, self.M, self.mu0 = f0, M, mu0
        self.z, self.v = np.zeros(2), np.zeros(3)
        self.y = 0.0

    def start(self, y: float) -> None:
        """Take the first sample."""
        self.z, self.v, self.y = np.array([y, 0.0]), np.zeros(3), y

    def step(self, dt: float, y: float, voltage: float) -> tuple[float, float, float]:
        """Go on by `dt` s and return x1, x2, w."""
        f, gu, h0, h1 = copy_step(dt, self.f0)
        self.z = f @ self.z + gu * (KU * voltage) + h0 * self.y + h1 * y
        self.v = taylor(dt) @ self.v
        b = y - self.z[0] - self.v[0]
        mu = self.mu0 if abs(b) < 1e-30 else max(self.mu0, (self.M / abs(b)) ** (1 / 3))
        self.v = self.v + gains(mu * dt) * b / np.array([1.0, dt, dt * dt])
        self.y = y
        v1, v2, v3 = self.v
        w = v3 + (L1 + self.f0) * v2 + (L2 + self.f0 * L1) * v1
        return float(self.z[0] + v1), float(self.z[1] + v2 + L1 * v1), float(w)
