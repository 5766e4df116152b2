"""Matched discretisation of the two halves of the cascade: the Luenberger copy and the differentiator."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

# Roots of s^3 + 2 s^2 + (3/sqrt 2) s + 1.1, the continuous differentiator's own polynomial with
# lambda = (2, 1.5, 1.1): -r and -a +- i c.
_ROOT_R = 0.9806592527262586
_ROOT_A = 0.5096703736368707
_ROOT_C = 0.9284021317842834
_NORM_MAX = 0.25  # of the norm of A dt
_SERIES_TERMS = 11  # with it, the first term left out is below 1e-16 of the first
_BANDWIDTH_STEP_MAX = 50.0  # beyond it every exponential is 0 to double precision, and cos(inf) would raise


class ObserverGains(NamedTuple):
    """Correction gains of one step: v1 += k1 b, v2 += k2 b / T, v3 += k3 b / T^2."""

    k1: float
    k2: float
    k3: float


class LuenbergerCopy(NamedTuple):
    """z <- F z + Gu u + H0 y_(k-1) + H1 y_k: eq. (6) solved exactly over one step."""

    f11: float
    f12: float
    f21: float
    f22: float
    gu1: float
    gu2: float
    h01: float
    h02: float
    h11: float
    h12: float


def matched_gains(x: float) -> ObserverGains:
    """Return the gains that put the step's error poles at exp(p_i x), p_i the continuous ones.

    Parameters
    ----------
    x
        mu T, bandwidth times step; capped at 50, where the gains have reached (1, 1.5, 1).
        NaN gives NaN.
    """
    x = min(x, _BANDWIDTH_STEP_MAX)
    d = -math.expm1(-_ROOT_R * x)
    m = math.exp(-2.0 * _ROOT_A * x)
    q = math.exp(-_ROOT_A * x) * math.cos(_ROOT_C * x)
    e1 = 2.0 - 2.0 * q
    e0 = 1.0 - 2.0 * q + m
    p1 = d + e1
    p3 = d * e0
    p2 = d * e1 + e0 - 0.5 * p3
    return ObserverGains(p1 - p2 + 0.5 * p3, p2 - p3, p3)


def luenberger_copy(dt: float, f0: float, gain1: float, gain2: float) -> LuenbergerCopy:
    """Solve eq. (6) over `dt` for u held and y linear between the samples.

    Parameters
    ----------
    dt
        s, the step.
    f0
        1/s, viscous friction.
    gain1, gain2
        L1 (1/s) and L2 (1/s2) of eq. (14).
    """
    generator = np.zeros((5, 5))  # of (z1, z2, u, y, y')
    generator[0] = (-gain1, 1.0, 0.0, gain1, 0.0)
    generator[1] = (-gain2, -f0, 1.0, gain2, 0.0)
    generator[3, 4] = 1.0
    e = _expm(generator * dt)
    h1 = e[:2, 4] / dt
    h0 = e[:2, 3] - h1
    return LuenbergerCopy(
        *e[0, :2].tolist(), *e[1, :2].tolist(), *e[:2, 2].tolist(), *h0.tolist(), *h1.tolist()
    )


def copy_step(dt: float, f0: float, gain1: float, gain2: float) -> LuenbergerCopy:
    """Solve the same as `luenberger_copy`, for a step that comes once: without a matrix, in microseconds.

    By Cayley and Hamilton every power of the 2x2 matrix A of eq. (6) is a A + b I; so the three series
    exp(A dt), its integral and the integral of that are six sums of numbers. They are exact to double
    precision where A dt is small; where it is not, the matrix exponential takes over.
    """
    if not dt * max(gain1 + 1.0, gain2 + f0) <= _NORM_MAX:
        return luenberger_copy(dt, f0, gain1, gain2)
    trace, determinant = -(gain1 + f0), gain1 * f0 + gain2
    a, b, c = 0.0, 1.0, 1.0  # A^k = a A + b I, and dt^k / k!
    e1 = i1 = d1 = 0.0  # what A is multiplied with: in exp(A dt), its integral, the integral of that
    e0 = i0 = d0 = 0.0  # and I
    for k in range(_SERIES_TERMS):
        c1 = c * dt / (k + 1)
        c2 = c1 * dt / (k + 2)
        e1 += a * c
        e0 += b * c
        i1 += a * c1
        i0 += b * c1
        d1 += a * c2
        d0 += b * c2
        a, b, c = trace * a + b, -determinant * a, c1
    p1, p2 = i0 * gain1 + i1 * (gain2 - gain1 * gain1), i0 * gain2 - i1 * gain2 * (gain1 + f0)
    q1, q2 = d0 * gain1 + d1 * (gain2 - gain1 * gain1), d0 * gain2 - d1 * gain2 * (gain1 + f0)
    h11, h12 = q1 / dt, q2 / dt
    return LuenbergerCopy(
        e0 - gain1 * e1, e1, -gain2 * e1, e0 - f0 * e1, i1, i0 - f0 * i1, p1 - h11, p2 - h12, h11, h12
    )


def _expm(
    matrix: np.ndarray[tuple[int, int], np.dtype[np.float64]],
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Matrix exponential by scaling, Taylor series and squaring; scipy is no dependency of the loop."""
    squarings = max(0, math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=1).max()), 1e-300))) + 1)
    scaled = matrix / 2.0**squarings
    term = np.eye(len(matrix))
    total = term.copy()
    for k in range(1, 20):  # norm <= 1/2: the remainder is below 1e-23
        term = term @ scaled / k
        total += term
    for _ in range(squarings):
        total = total @ total
    return total
