"""How far the innovations let the model be trusted, and the noise that is assumed because of it."""

from __future__ import annotations

import math
from typing import NamedTuple

from dcmp_hil.common.fast_tuple import make

_SLOW_RATE, _FAST_RATE = 0.04, 0.2  # of a mean, per innovation
_SLOW_WEIGHT, FAST_WEIGHT = 49.0, 9.0
"""(2 - r)/r for both rates: so much times the mean's square is chi^2(1) for white innovations."""
_CLIP = 4.0  # standard deviations
_DECAY_S = 0.04  # s, of the inflation
_INFLATION_MAX, _SLOPE_INFLATION_MAX = 300.0, 100.0
_CALM_S, _CALM_STEP_MAX = 0.3, 50.0  # s of the mean that tells a calm; what one step may add to it
_SCATTER_RATE, _SCATTER_MEAN, _SCATTER_MAX = 0.02, 1.5, 30.0
_SCATTER_CLIP, _SCATTER_INFLATION_MAX = 9.0, 10.0


class Trust(NamedTuple):
    """What is remembered of the innovations.

    A lag shows as innovations of one sign long before any one of them is large: so the trigger is a signed
    mean, and not the size of the innovations.
    """

    m: float = 1.0  # inflation of the disturbance's noise; 1 while the model is believed
    slope_m: float = 1.0  # of its slope's noise
    calm: float = 0.0  # mean of m over 0.3 s
    slow: float = 0.0  # means of the normalised innovations
    fast: float = 0.0
    scatter: float = 1.0  # inflation of the encoder's noise


def judged(trust: Trust, nu: float, step: float, *, edge: bool) -> Trust:
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
        scatter *= 1.0 + _SCATTER_RATE * (
            (min(_SCATTER_CLIP, square)) - _SCATTER_MEAN
        )
        scatter = 1.0 if scatter < 1.0 else min(_SCATTER_MAX, scatter)
    if square > _CLIP * _CLIP:
        nu = math.copysign(_CLIP, nu)
    slow += _SLOW_RATE * (nu - slow)
    fast += _FAST_RATE * (nu - fast)
    z = 0.5 * _SLOW_WEIGHT * slow * slow
    target = z * z if z > 1.0 else 1.0
    if target > m:
        m = min(_INFLATION_MAX, target)
    elif target != m:
        m = target + (m - target) * math.exp(-step / _DECAY_S)
    slope_m = min(_SLOPE_INFLATION_MAX, target)
    rise = m - calm
    calm += (min(_CALM_STEP_MAX, rise)) * step / _CALM_S
    return make(Trust, (m, slope_m, calm, slow, fast, scatter))


def calmed(trust: Trust, step: float) -> Trust:
    """Return the trust at the end of a step without an innovation."""
    m, slope_m, calm, slow, fast, scatter = trust
    if m != 1.0:
        m = 1.0 + (m - 1.0) * math.exp(-step / _DECAY_S)
    rise = m - calm
    calm += (min(_CALM_STEP_MAX, rise)) * step / _CALM_S
    return make(Trust, (m, slope_m, calm, slow, fast, scatter))
