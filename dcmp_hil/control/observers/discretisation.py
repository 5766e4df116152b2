"""Matched discretisation of the two halves of the cascade: the Luenberger copy and the differentiator.

Sums and `control.elementary` alone make the coefficients: they are the same bits on every computer.
"""

from __future__ import annotations

from typing import NamedTuple

from dcmp_hil.control.elementary import expm1, sine

# Roots of s^3 + 2 s^2 + (3/sqrt 2) s + 1.1, the continuous differentiator's own polynomial with
# lambda = (2, 1.5, 1.1): -r and -a +- i c.
_ROOT_R = 0.9806592527262586
_ROOT_A = 0.5096703736368707
_ROOT_C = 0.9284021317842834
_NORM_MAX = 0.25  # of the norm of A dt
_SERIES_TERMS = 11  # with it, the first term left out is below 1e-16 of the first
_DOUBLINGS_MAX = 200  # of a step, from where the series holds; a longer one has no end that is finite
_BANDWIDTH_STEP_MAX = 50.0  # beyond it every exponential is 0 to double precision


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

    def differences(self) -> tuple[float, float, float, float, float, float, float, float]:
        """Return f12 f22 gu1 gu2 h01 h02 h11 h12 of the same step, written in y - z1.

        A constant y with z1 = y and z2 = 0 is a rest: so f11 = 1 - h01 - h11 and f21 = -h02 - h12, and

            z1 += h01 (y_(k-1) - z1) + h11 (y_k - z1) + f12 z2 + gu1 u,
            z2 <- f22 z2 + gu2 u + h02 (y_(k-1) - z1) + h12 (y_k - z1),

        both with the old z1 and z2.
        """
        _, f12, _, *rest = self
        f22, gu1, gu2, h01, h02, h11, h12 = rest
        return f12, f22, gu1, gu2, h01, h02, h11, h12


def matched_gains(x: float) -> ObserverGains:
    """Return the gains that put the step's error poles at exp(p_i x), p_i the continuous ones.

    With E = exp(-a x) - 1 and S = sin(c x / 2), nothing is left of a difference of numbers near 1: at
    x = 0.04, 1 - 2 exp(-a x) cos(c x) + exp(-2 a x) loses four digits.

    Parameters
    ----------
    x
        mu T, bandwidth times step; capped at 50, where the gains have reached (1, 1.5, 1).
        NaN gives NaN.
    """
    return ObserverGains(*plain_gains(x))


def plain_gains(x: float) -> tuple[float, float, float]:
    """Return `matched_gains` as a plain tuple: 0.08 us less a step of R1, which asks in a third of them."""
    x = min(x, _BANDWIDTH_STEP_MAX)
    e, s, d = expm1(-_ROOT_A * x), sine(0.5 * _ROOT_C * x), -expm1(-_ROOT_R * x)
    g = (1.0 + e) * (s * s)
    e0 = e * e + 4.0 * g
    e1 = 2.0 * (2.0 * g - e)
    p1 = d + e1
    p3 = d * e0
    p2 = d * e1 + e0 - 0.5 * p3
    return p1 - p2 + 0.5 * p3, p2 - p3, p3


_Pair = tuple[float, float]
"""a and b of a A + b I; A is the matrix of eq. (6)."""


def luenberger_copy(dt: float, f0: float, gain1: float, gain2: float) -> LuenbergerCopy:
    """Solve eq. (6) over `dt` for u held and y linear between the samples.

    By Cayley and Hamilton every power of the 2x2 matrix A of eq. (6) is a A + b I; so the three series
    exp(A h), its integral I and the integral D of that are six sums of numbers. They are exact to double
    precision where A h is small; a longer step is doubled from there:

        exp(2 A h) = exp(A h)^2,  I(2h) = I + exp(A h) I,  D(2h) = D + h I + exp(A h) D.

    Parameters
    ----------
    dt
        s, the step.
    f0
        1/s, viscous friction.
    gain1, gain2
        L1 (1/s) and L2 (1/s2) of eq. (14).
    """
    trace, determinant = -(gain1 + f0), gain1 * f0 + gain2
    h, norm, doublings = dt, dt * max(gain1 + 1.0, gain2 + f0), 0
    while norm > _NORM_MAX and doublings < _DOUBLINGS_MAX:
        h, norm, doublings = 0.5 * h, 0.5 * norm, doublings + 1
    (e1, e0), (i1, i0), (d1, d0) = _series(h, trace, determinant)
    for _ in range(doublings):
        di1, di0 = _product((e1, e0), (i1, i0), trace, determinant)
        dd1, dd0 = _product((e1, e0), (d1, d0), trace, determinant)
        d1, d0 = d1 + h * i1 + dd1, d0 + h * i0 + dd0
        i1, i0 = i1 + di1, i0 + di0
        e1, e0 = _product((e1, e0), (e1, e0), trace, determinant)
        h = 2.0 * h
    p1, p2 = i0 * gain1 + i1 * (gain2 - gain1 * gain1), i0 * gain2 - i1 * gain2 * (gain1 + f0)
    q1, q2 = d0 * gain1 + d1 * (gain2 - gain1 * gain1), d0 * gain2 - d1 * gain2 * (gain1 + f0)
    h11, h12 = q1 / dt, q2 / dt
    return LuenbergerCopy(
        e0 - gain1 * e1, e1, -gain2 * e1, e0 - f0 * e1, i1, i0 - f0 * i1, p1 - h11, p2 - h12, h11, h12
    )


def _series(h: float, trace: float, determinant: float) -> tuple[_Pair, _Pair, _Pair]:
    """Return exp(A h), its integral, and the integral of that, where A h is small."""
    a, b, c = 0.0, 1.0, 1.0  # A^k = a A + b I, and h^k / k!
    e1 = i1 = d1 = e0 = i0 = d0 = 0.0
    for k in range(_SERIES_TERMS):
        c1 = c * h / (k + 1)
        c2 = c1 * h / (k + 2)
        e1 += a * c
        e0 += b * c
        i1 += a * c1
        i0 += b * c1
        d1 += a * c2
        d0 += b * c2
        a, b, c = trace * a + b, -determinant * a, c1
    return (e1, e0), (i1, i0), (d1, d0)


def _product(p: _Pair, q: _Pair, trace: float, determinant: float) -> _Pair:
    """Return (a A + b I) (a' A + b' I), with A^2 = trace A - determinant I."""
    (a, b), (c, d) = p, q
    both = a * c
    return both * trace + a * d + b * c, b * d - both * determinant
