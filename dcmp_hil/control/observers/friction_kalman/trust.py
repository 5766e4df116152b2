"""Trust in the model by its innovations, and the noise that is assumed because of it.

A lag shows as innovations of one sign long before any one of them is large: so the trigger is a signed mean,
and not the size of the innovations.
"""

from __future__ import annotations

import math
from functools import lru_cache

from dcmp_hil.control.elementary import exponential

Trust = tuple[float, float, float, float, float, float]
"""m, the inflation of the disturbance's noise, 1 while the model is believed; that of its slope's noise; the
mean of m over 0.3 s; a slow and a fast mean of the innovations over their deviation; the inflation of the
encoder's noise."""

BELIEVED: Trust = (1.0, 1.0, 0.0, 0.0, 0.0, 1.0)
"""At the start."""

_SLOW_RATE, _FAST_RATE = 0.04, 0.2  # of a mean, per innovation
_SLOW_WEIGHT, _FAST_WEIGHT = 49.0, 9.0  # (2 - r)/r: with it the square of a mean is chi^2(1) for white ones
_CLIP = 4.0  # standard deviations
_DECAY_S = 0.04  # s, of m
_INFLATION_MAX, _SLOPE_INFLATION_MAX = 300.0, 100.0
_CALM_S, _CALM_STEP_MAX = 0.3, 50.0  # s; by how much m counts above its mean
_SCATTER_RATE, _SCATTER_MEAN, _SCATTER_MAX = 0.02, 1.5, 30.0
_SCATTER_CLIP, _SCATTER_INFLATION_MAX = 9.0, 10.0
_STEP_CHI2 = 30.0


@lru_cache(maxsize=256)  # 0.2 us less: a clock that is even has few steps that differ in their last bits
def _kept(step: float) -> float:
    """Return what is left of m after a step, s."""
    return exponential(-step / _DECAY_S)


def judged(trust: Trust, nu: float, step: float, edge: bool) -> Trust:
    """Return the trust at the end of a step with an innovation.

    Parameters
    ----------
    trust
        As it was after the last step.
    nu
        Innovation over its standard deviation.
    step
        s.
    edge
        Whether the count changed.
    """
    m, _, calm, slow, fast, scatter = trust
    square = nu * nu
    if edge and m < _SCATTER_INFLATION_MAX:
        grown = scatter * (1.0 + _SCATTER_RATE * (min(square, _SCATTER_CLIP) - _SCATTER_MEAN))
        scatter = grown if 1.0 <= grown <= _SCATTER_MAX else max(1.0, min(grown, _SCATTER_MAX))
    if square > _CLIP * _CLIP:
        nu = math.copysign(_CLIP, nu)
    slow += _SLOW_RATE * (nu - slow)
    fast += _FAST_RATE * (nu - fast)
    z = 0.5 * _SLOW_WEIGHT * slow * slow
    target = slope_m = 1.0
    if z > 1.0:
        target = z * z
        slope_m = min(target, _SLOPE_INFLATION_MAX)
    if target > m:
        m = min(target, _INFLATION_MAX)
    elif m != 1.0:
        m = target + (m - target) * _kept(step)
    calm += (m - calm if m < calm + _CALM_STEP_MAX else _CALM_STEP_MAX) * step / _CALM_S
    return m, slope_m, calm, slow, fast, scatter


def calmed(trust: Trust, step: float) -> Trust:
    """Return the trust at the end of a step without an innovation."""
    m, slope_m, calm, slow, fast, scatter = trust
    if m != 1.0:
        m = 1.0 + (m - 1.0) * _kept(step)
    return (
        m,
        slope_m,
        calm + (m - calm if m < calm + _CALM_STEP_MAX else _CALM_STEP_MAX) * step / _CALM_S,
        slow,
        fast,
        scatter,
    )


def stepped(fast: float, nu: float) -> bool:
    """Return whether the innovations of late are large enough, and of the same sign as `nu`, for a step."""
    return _FAST_WEIGHT * fast * fast > _STEP_CHI2 and nu * fast > 0.0 and nu * nu > 1.0


def halved(trust: Trust) -> Trust:
    """Return the trust after a step was assumed, which explains half of the fast mean."""
    m, slope_m, calm, slow, fast, scatter = trust
    return m, slope_m, calm, slow, 0.5 * fast, scatter
