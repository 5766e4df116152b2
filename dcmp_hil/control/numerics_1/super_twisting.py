"""R1 and the linear predictor of numerics 1."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.control.observers import GAP_PERIODS_MAX, standing_still
from dcmp_hil.control.observers.super_twisting import SuperTwisting, bandwidth_floor
from dcmp_hil.control.predictor import LinearPredictor
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.control.model import Model
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.control.observers.super_twisting import Tuning
    from dcmp_hil.values import Sample

    Gains = tuple[float, float, float]

_ROOT_R, _ROOT_A, _ROOT_C = 0.9806592527262586, 0.5096703736368707, 0.9284021317842834
_INNOVATION_MIN_RAD, _NORM_MAX = 1e-30, 0.25
_NEGLIGIBLE_F0_PERIOD, _SERIES_F0_PERIOD_MAX = 1e-17, 1e-2


class SuperTwisting1(SuperTwisting):
    """R1 with a copy z <- F z + Gu u + H0 y_(k-1) + H1 y_k; arguments as for `SuperTwisting`."""

    def __init__(
        self, context: ObserverContext, *, L1: float, L2: float, M: float | None, mu0: float | None
    ) -> None:
        self._by_rule = bandwidth_floor(context.counts_per_rev, context.period)
        self._by_rule_1 = _bandwidth_floor(context.counts_per_rev, context.period)
        super().__init__(context, L1=L1, L2=L2, M=M, mu0=mu0)

    def _use(self, tuning: Tuning) -> None:
        super()._use(tuning)
        if self.mu0 == self._by_rule:
            self.mu0 = self._by_rule_1
        cube = self.mu0**3
        self._floor_from = self.M / cube if cube > 0.0 else math.inf
        self._lengths = {n: self._solve(n * self._period) for n in range(1, GAP_PERIODS_MAX + 1)}

    def _solve(self, dt: float) -> tuple[list[float], Gains]:
        copy = _luenberger_copy(dt, self._f0, self._L1, self._L2)
        return copy, _over(_matched_gains(self.mu0 * dt), dt)

    def update(self, sample: Sample) -> Estimate:
        """Advance to `sample.t` over the voltage really applied, and correct by its position."""
        t, y, voltage, _ = sample
        dt = t - self._t
        if self._shortest < dt < self._longest:
            found = self._lengths[1]
        elif dt <= 0.0:
            raise standing_still(self._t, t)
        elif not dt < GAP_PERIODS_MAX * self._period + self._tolerance:  # NaN: the first sample
            return self._restart(t, y)
        else:
            found = self._of_length(dt)
        (f11, f12, f21, f22, gu1, gu2, h01, h02, h11, h12), (k1, k2, k3) = found
        u, y0 = self._ku * voltage, self._y
        z1, z2, v2, v3 = self._z1, self._z2, self._v2, self._v3
        z1, z2 = (
            f11 * z1 + f12 * z2 + gu1 * u + h01 * y0 + h11 * y,
            f21 * z1 + f22 * z2 + gu2 * u + h02 * y0 + h12 * y,
        )
        v1 = self._v1 + dt * (v2 + 0.5 * dt * v3)
        v2 = v2 + dt * v3
        b = y - z1 - v1
        if not abs(b) >= self._floor_from:
            size = abs(b)
            mu = self.mu0 if size < _INNOVATION_MIN_RAD else (self.M / size) ** (1 / 3)
            k1, k2, k3 = _over(_matched_gains(mu * dt), dt)
        self._v1 = v1 = v1 + k1 * b
        self._v2 = v2 = v2 + k2 * b
        self._v3 = v3 = v3 + k3 * b
        self._t, self._y, self._z1, self._z2 = t, y, z1, z2
        return Estimate(z1 + v1, z2 + v2 + self._L1 * v1, v3 + self._w2 * v2 + self._w1 * v1)

    def _of_length(self, dt: float) -> tuple[list[float], Gains]:
        n = round(dt / self._period)
        if n in self._lengths and abs(dt - n * self._period) < self._tolerance:
            return self._lengths[n]
        gains = _over(_matched_gains(self.mu0 * dt), dt)
        return _copy_step(dt, self._f0, self._L1, self._L2), gains


def _bandwidth_floor(counts_per_rev: float | None, period: float) -> float:
    largest = 0.3 / period
    if counts_per_rev is None:
        return largest
    usual: float = 40.0 * (counts_per_rev / 4096.0) ** (1 / 3) * (1e-3 / period) ** (1 / 6)
    return min(usual, largest)


def _matched_gains(x: float) -> Gains:
    x = min(x, 50.0)
    d = -math.expm1(-_ROOT_R * x)
    m = math.exp(-2.0 * _ROOT_A * x)
    q = math.exp(-_ROOT_A * x) * math.cos(_ROOT_C * x)
    e1 = 2.0 - 2.0 * q
    e0 = 1.0 - 2.0 * q + m
    p1 = d + e1
    p3 = d * e0
    p2 = d * e1 + e0 - 0.5 * p3
    return p1 - p2 + 0.5 * p3, p2 - p3, p3


def _over(gains: Gains, dt: float) -> Gains:
    k1, k2, k3 = gains
    return k1, k2 / dt, k3 / (dt * dt)


def _luenberger_copy(dt: float, f0: float, gain1: float, gain2: float) -> list[float]:
    generator = np.zeros((5, 5))  # of (z1, z2, u, y, y')
    generator[0] = (-gain1, 1.0, 0.0, gain1, 0.0)
    generator[1] = (-gain2, -f0, 1.0, gain2, 0.0)
    generator[3, 4] = 1.0
    e = _expm(generator * dt)
    h1 = e[:2, 4] / dt
    h0 = e[:2, 3] - h1
    found: list[float] = np.concatenate((e[0, :2], e[1, :2], e[:2, 2], h0, h1)).tolist()
    return found


def _expm(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    squarings = max(0, math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=1).max()), 1e-300))) + 1)
    scaled = matrix / 2.0**squarings
    term = np.eye(len(matrix))
    total = term.copy()
    for k in range(1, 20):
        term = term @ scaled / k
        total += term
    for _ in range(squarings):
        total = total @ total
    return total


def _copy_step(dt: float, f0: float, gain1: float, gain2: float) -> list[float]:
    if not dt * max(gain1 + 1.0, gain2 + f0) <= _NORM_MAX:
        return _luenberger_copy(dt, f0, gain1, gain2)
    trace, determinant = -(gain1 + f0), gain1 * f0 + gain2
    a, b, c = 0.0, 1.0, 1.0
    e1 = i1 = d1 = e0 = i0 = d0 = 0.0
    for k in range(11):
        c1 = c * dt / (k + 1)
        c2 = c1 * dt / (k + 2)
        e1, e0 = e1 + a * c, e0 + b * c
        i1, i0 = i1 + a * c1, i0 + b * c1
        d1, d0 = d1 + a * c2, d0 + b * c2
        a, b, c = trace * a + b, -determinant * a, c1
    p1, p2 = i0 * gain1 + i1 * (gain2 - gain1 * gain1), i0 * gain2 - i1 * gain2 * (gain1 + f0)
    q1, q2 = d0 * gain1 + d1 * (gain2 - gain1 * gain1), d0 * gain2 - d1 * gain2 * (gain1 + f0)
    h11, h12 = q1 / dt, q2 / dt
    return [e0 - gain1 * e1, e1, -gain2 * e1, e0 - f0 * e1, i1, i0 - f0 * i1, p1 - h11, p2 - h12, h11, h12]


class LinearPredictor1(LinearPredictor):
    """`LinearPredictor` by the exponentials of libm; the same arguments."""

    def __init__(self, model: Model, period: float, delay_samples: int, *, measured: bool) -> None:
        super().__init__(model, period, delay_samples, measured=measured)
        f0, x = model.f0, model.f0 * period
        self._a = math.exp(-f0 * period)
        if x < _NEGLIGIBLE_F0_PERIOD:
            return
        self._p1 = p1 = -math.expm1(-x) / f0
        series = 1 / 2 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x / 5040))))
        self._p2 = (period - p1) / f0 if x > _SERIES_F0_PERIOD_MAX else period * period * series
