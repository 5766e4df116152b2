"""One step of the arm with Coulomb friction that can stick; the observer and its predictor share it."""

from __future__ import annotations

import math

from dcmp_hil.control.elementary import sine

SLOPE_LEAK_1_S = 0.3
"""1/s: the slope of the disturbance decays at this rate."""

Motion = tuple[float, float, float, float, float, float]


def moved(
    x1: float, x2: float, d: float, f: float, s: float, step: float, u: float, f0: float, gravity: float
) -> Motion:
    """Move the arm over one step by x1'' = -f0 x2 - f sgn x2 + d - g sin x1 + u, d' = s.

    Friction is a set, as in Moreau's time-stepping (Acary and Brogliato 2008): the arm sticks while what
    drives it stays within f, and an arm that comes to rest inside the step either sticks or turns there.

    Parameters
    ----------
    x1, x2
        rad and rad/s at the start of the step.
    d, f, s
        Disturbance and friction level, rad/s2; slope of the disturbance, rad/s3.
    step
        s, above 0.
    u
        Input held over the step, (ku/J) V, rad/s2.
    f0, gravity
        1/s and rad/s2.

    Returns
    -------
    tuple
        x1, x2, d and s at the end; the acceleration without Coulomb friction, rad/s2; the direction of the
        motion, -1 or 1, and 0 where the arm sticks.
    """
    d += step * s
    s *= 1.0 - SLOPE_LEAK_1_S * step
    a = d - gravity * sine(x1 + 0.5 * step * x2) + u - f0 * x2
    if x2 > 0.0:
        direction = 1.0
    elif x2 < 0.0:
        direction = -1.0
    elif a > f:
        direction = 1.0
    elif a < -f:
        direction = -1.0
    else:
        return x1, 0.0, d, s, a, 0.0
    net = a - direction * f
    v = x2 + step * net
    if v * direction > 0.0 or x2 == 0.0:
        return x1 + 0.5 * step * (x2 + v), v, d, s, a, direction
    stopped_after = -x2 / net
    x1 += 0.5 * x2 * stopped_after
    a += f0 * x2
    if abs(a) <= f:
        return x1, 0.0, d, s, a, 0.0
    direction = math.copysign(1.0, a)
    left = step - stopped_after
    v = left * (a - direction * f)
    return x1 + 0.5 * left * v, v, d, s, a, direction
