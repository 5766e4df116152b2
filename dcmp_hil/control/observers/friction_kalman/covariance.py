"""The covariance of (x1, x2, d, f, s), written out: its upper triangle, row by row.

The products of the same matrices with numpy cost 20 times as much (docs/observers.md); a test compares both.
"""

from __future__ import annotations

from dcmp_hil.control.elementary import cosine
from dcmp_hil.control.observers.friction_kalman.motion import SLOPE_LEAK_1_S

Covariance = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float, float
]
"""P00 P01 P02 P03 P04, P11 P12 P13 P14, P22 P23 P24, P33 P34, P44."""

Noise = tuple[float, float, float]
"""Variance added in a step to disturbance and friction, (rad/s2)2, and to the slope, (rad/s3)2."""

_STUCK_VARIANCE = 1e-5
"""(rad/s)2: of the velocity of an arm that sticks."""
_CREEP = 1e-6  # rad2/s, of the position of an arm that sticks
_VELOCITY_NOISE = 3e-6  # (rad/s)2/s


def slipped(
    p: Covariance, x1: float, direction: float, step: float, f0: float, gravity: float, noise: Noise
) -> Covariance:
    """Return the covariance after a step in which the arm moves; arguments as for `moved`.

    `x1` and `direction` are those at the end of the step. With the row b of F for x2, that for x1 is
    (1, c, 0, 0, 0) + T/2 b with c = T/2 (1 + f0 T): so half of the products are there already.
    """
    p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, p23, p24, p33, p34, p44 = p
    b0, b1, b3 = -step * gravity * cosine(x1), 1.0 - f0 * step, -direction * step
    half = 0.5 * step
    c = half * (1.0 + f0 * step)
    h0 = b0 * p00 + b1 * p01 + step * p02 + b3 * p03
    h1 = b0 * p01 + b1 * p11 + step * p12 + b3 * p13
    h2 = b0 * p02 + b1 * p12 + step * p22 + b3 * p23
    h3 = b0 * p03 + b1 * p13 + step * p23 + b3 * p33
    h4 = b0 * p04 + b1 * p14 + step * p24 + b3 * p34
    g0 = p00 + c * p01 + half * h0
    g1 = p01 + c * p11 + half * h1
    g2 = p02 + c * p12 + half * h2
    g3 = p03 + c * p13 + half * h3
    g4 = p04 + c * p14 + half * h4
    p01 = b0 * g0 + b1 * g1 + step * g2 + b3 * g3
    p11 = b0 * h0 + b1 * h1 + step * h2 + b3 * h3 + _VELOCITY_NOISE * step
    p00 = g0 + c * g1 + half * p01
    # The slope decays, and moves the disturbance.
    d_noise, f_noise, s_noise = noise
    kept = 1.0 - SLOPE_LEAK_1_S * step
    g4 *= kept
    h4 *= kept
    p24 *= kept
    p34 *= kept
    p44 *= kept * kept
    p22 += step * (2.0 * p24 + step * p44) + d_noise
    # fmt: off
    return (
        p00, p01, g2 + step * g4, g3, g4, p11, h2 + step * h4, h3, h4,
        p22, p23 + step * p34, p24 + step * p44, p33 + f_noise, p34, p44 + s_noise,
    )
    # fmt: on


def stuck(p: Covariance, step: float, noise: Noise) -> Covariance:
    """Return the covariance after a step in which the arm sticks: its velocity is 0, and it creeps."""
    p00, _, p02, p03, p04, _, _, _, _, p22, p23, p24, p33, p34, p44 = p
    d_noise, f_noise, s_noise = noise
    kept = 1.0 - SLOPE_LEAK_1_S * step
    p04 *= kept
    p24 *= kept
    p34 *= kept
    p44 *= kept * kept
    p22 += step * (2.0 * p24 + step * p44) + d_noise
    # fmt: off
    return (
        p00 + _CREEP * step, 0.0, p02 + step * p04, p03, p04, _STUCK_VARIANCE, 0.0, 0.0, 0.0,
        p22, p23 + step * p34, p24 + step * p44, p33 + f_noise, p34, p44 + s_noise,
    )
    # fmt: on


def released(p: Covariance, error: float, x2: float, friction: float) -> Covariance:
    """Return the covariance of an arm that stuck and was seen to move.

    Parameters
    ----------
    p
        As predicted.
    error
        rad, from the predicted position to the edge that was passed.
    x2, friction
        rad/s and rad/s2, as they are assumed now.
    """
    p00, p01, p02, p03, p04, _, p12, p13, p14, p22, *rest = p
    p23, p24, p33, p34, p44 = rest
    return (
        *(p00 + error * error, p01, p02, p03, p04, x2 * x2, p12, p13, p14),
        *(p22 + friction * friction, p23, p24, p33, p34, p44),
    )


def widened(p: Covariance, age: float, variance: float) -> Covariance:
    """Return P + variance v v', v = (age^2/2, age, 1): the disturbance stepped `age` s ago."""
    p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, *rest = p
    p23, p24, p33, p34, p44 = rest
    v0 = 0.5 * age * age
    return (
        *(p00 + variance * v0 * v0, p01 + variance * v0 * age, p02 + variance * v0, p03, p04),
        *(p11 + variance * age * age, p12 + variance * age, p13, p14),
        *(p22 + variance, p23, p24, p33, p34, p44),
    )
