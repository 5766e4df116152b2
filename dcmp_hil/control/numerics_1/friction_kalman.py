"""The friction Kalman filter and its predictor of numerics 1."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.control.observers.friction_kalman.covariance import released, stuck, widened
from dcmp_hil.control.observers.friction_kalman.motion import SLOPE_LEAK_1_S
from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
from dcmp_hil.control.observers.friction_kalman.predictor import FrictionPredictor
from dcmp_hil.control.observers.friction_kalman.trust import halved, stepped
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.control.observers.friction_kalman.covariance import Covariance, Noise
    from dcmp_hil.control.observers.friction_kalman.motion import Motion
    from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalmanTuning, State
    from dcmp_hil.control.observers.friction_kalman.trust import Trust
    from dcmp_hil.values import Reference, Sample

_SLOPE_NOISE, _FRICTION_NOISE = 5.0, 1e-3
_REVERSAL_NOISE, _REVERSAL_RAD_S = 1.0, 0.06
_UNCHANGED_COUNTS = 0.35
_RELEASE_GATE = 9.0
_STEP_AGE_S, _STEP_DEVIATION_MAX = 0.025, 300.0
_STEP_CALM_MAX, _STEP_SPEED_MIN_RAD_S = 2.5, 0.1
_VELOCITY_NOISE = 3e-6
_SLOW_RATE, _FAST_RATE = 0.04, 0.2
_SLOW_WEIGHT, _FAST_WEIGHT = 49.0, 9.0
_CLIP = 4.0
_DECAY_S = 0.04
_INFLATION_MAX, _SLOPE_INFLATION_MAX = 300.0, 100.0
_CALM_S, _CALM_STEP_MAX = 0.3, 50.0
_SCATTER_RATE, _SCATTER_MEAN, _SCATTER_MAX = 0.02, 1.5, 30.0
_SCATTER_CLIP, _SCATTER_INFLATION_MAX = 9.0, 10.0
_CROSSING_RAD_S = 0.001


class FrictionKalman1(FrictionKalman):
    """The filter by the functions of libm; arguments as for `FrictionKalman`."""

    def __init__(
        self, context: ObserverContext, *, d_noise: float, edge_counts: float, f1_uncertainty: float
    ) -> None:
        super().__init__(context, d_noise=d_noise, edge_counts=edge_counts, f1_uncertainty=f1_uncertainty)
        self._unchanged_variance = (_UNCHANGED_COUNTS * self._q) ** 2

    def retune(self, tuning: FrictionKalmanTuning) -> None:
        """Change the noises; the state stays."""
        super().retune(tuning)
        self._edge_variance = (tuning.edge_counts * self._q) ** 2

    def update(self, sample: Sample) -> Estimate:
        """Advance to `sample.t` over the voltage really applied, and correct by its count."""
        t, y, voltage, _ = sample
        step = t - self._t
        if not 0.0 < step <= self._restart_after:
            return self._begin(t, y)
        u, f0, gravity = self._ku * voltage, self._f0, self._gravity
        x1, x2, d, f, s = self.state
        if (x1 + x2 + y + voltage) * 0.0 != 0.0:  # not finite; math.isfinite takes 0.03 us more
            return self._lose(t)
        x1, x2, d, s, a, direction = _moved(x1, x2, d, f, s, step, u, f0, gravity)

        m, slope_m, _, _, _, scatter = trust = self.trust
        d_noise, f_noise = self._d_noise * step * m, _FRICTION_NOISE * step
        if -_REVERSAL_RAD_S < x2 < _REVERSAL_RAD_S:
            d_noise, f_noise = d_noise + _REVERSAL_NOISE * step, f_noise * (30.0 * m - 29.0)
        noise = d_noise, f_noise, _SLOPE_NOISE * step * slope_m
        if direction:
            p = _slipped(self.covariance, x1, direction, step, f0, gravity, noise)
        else:
            p = stuck(self.covariance, step, noise)

        off, reach = y - x1, self._half_count
        rise = self._rise(y) if y != self._y else 0
        self._t, self._y, self.sticks = t, y, not direction
        if rise:
            x1, x2, d, f, s = self._by_edge((x1, x2, d, f, s), p, a, rise, step)
        elif off > reach or off < -reach:
            e, r = off - math.copysign(reach, off), scatter * self._unchanged_variance
            x1, x2, d, f, s = self._corrected((x1, x2, d, f, s), p, (e, 0.0, r), step, False)
        else:
            self.covariance, self.trust = p, _calmed(trust, step)

        self.state = x1, x2, d, f, s
        w = d - gravity * math.sin(x1) - (f if x2 > 0.0 else -f) if x2 else -u
        return Estimate(x1, x2, w)

    def _by_edge(self, x: State, p: Covariance, a: float, rise: int, step: float) -> State:
        x1, x2, d, f, s = x
        q, speed = self._q, abs(x2)
        span = q / speed if speed * step > q else step
        passed = self._y - (self._half_count if rise > 0 else -self._half_count)
        e, h = passed - x1 + 0.5 * span * x2, -0.5 * span
        r = self.trust[5] * self._edge_variance + (x2 * span) ** 2 / 12.0
        since, self._edge_t = self._t - self._edge_t, self._t
        if self.sticks and e * e > _RELEASE_GATE * (p[0] + r):
            self.sticks = False
            d = math.copysign(f, e) - (a - d)
            x2 = 0.5 * e / max(since, 2.0 * step)
            p = released(p, e, x2, f)
        return self._corrected((x1, x2, d, f, s), p, (e, h, r), step, True)

    def _corrected(
        self, x: State, p: Covariance, measured: tuple[float, float, float], step: float, edge: bool
    ) -> State:
        e, h, r = measured
        variance = p[0] + h * (2.0 * p[1] + h * p[5]) + r
        nu = e / math.sqrt(variance)
        trust = _judged(self.trust, nu, step, edge)
        x1, x2, d, f, s = x
        if stepped(trust[4], nu) and self.trust[2] < _STEP_CALM_MAX and abs(x2) >= _STEP_SPEED_MIN_RAD_S:
            p, trust = _explained(p, e, h, variance), halved(trust)
            variance = p[0] + h * (2.0 * p[1] + h * p[5]) + r
            self.steps += 1
        p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, p23, p24, p33, p34, p44 = p
        h0, h1, h2, h3, h4 = p00 + h * p01, p01 + h * p11, p02 + h * p12, p03 + h * p13, p04 + h * p14
        k0, k1, k2, k3, k4 = h0 / variance, h1 / variance, h2 / variance, h3 / variance, h4 / variance
        self.trust = trust
        # fmt: off
        self.covariance = (
            p00 - k0 * h0, p01 - k0 * h1, p02 - k0 * h2, p03 - k0 * h3, p04 - k0 * h4,
            p11 - k1 * h1, p12 - k1 * h2, p13 - k1 * h3, p14 - k1 * h4,
            p22 - k2 * h2, p23 - k2 * h3, p24 - k2 * h4, p33 - k3 * h3, p34 - k3 * h4, p44 - k4 * h4,
        )
        # fmt: on
        f += k3 * e
        if not 0.0 <= f <= self._f_max:
            f = max(0.0, min(f, self._f_max))
        return x1 + k0 * e, x2 + k1 * e, d + k2 * e, f, s + k4 * e


def _explained(p: Covariance, e: float, h: float, variance: float) -> Covariance:
    half = 0.5 * _STEP_AGE_S * _STEP_AGE_S
    seen = max(half + h * _STEP_AGE_S, 0.5 * half)
    return widened(p, _STEP_AGE_S, min((e * e - variance) / (seen * seen), _STEP_DEVIATION_MAX**2))


def _moved(
    x1: float, x2: float, d: float, f: float, s: float, step: float, u: float, f0: float, gravity: float
) -> Motion:
    d += step * s
    s *= 1.0 - SLOPE_LEAK_1_S * step
    a = d - gravity * math.sin(x1 + 0.5 * step * x2) + u - f0 * x2
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


def _slipped(
    p: Covariance, x1: float, direction: float, step: float, f0: float, gravity: float, noise: Noise
) -> Covariance:
    p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, p23, p24, p33, p34, p44 = p
    b0, b1, b3 = -step * gravity * math.cos(x1), 1.0 - f0 * step, -direction * step
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


def _judged(trust: Trust, nu: float, step: float, edge: bool) -> Trust:
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
        m = target + (m - target) * math.exp(-step / _DECAY_S)
    calm += (m - calm if m < calm + _CALM_STEP_MAX else _CALM_STEP_MAX) * step / _CALM_S
    return m, slope_m, calm, slow, fast, scatter


def _calmed(trust: Trust, step: float) -> Trust:
    m, slope_m, calm, slow, fast, scatter = trust
    if m != 1.0:
        m = 1.0 + (m - 1.0) * math.exp(-step / _DECAY_S)
    return (
        m,
        slope_m,
        calm + (m - calm if m < calm + _CALM_STEP_MAX else _CALM_STEP_MAX) * step / _CALM_S,
        slow,
        fast,
        scatter,
    )


class FrictionPredictor1(FrictionPredictor):
    """Its predictor by the sine of libm; arguments as for `FrictionPredictor`."""

    def ahead(self, sample: Sample, estimate: Estimate, reference: Reference) -> Estimate:  # noqa: ARG002
        """Return the state at the instant at which the next command takes effect; see `Predictor`."""
        x1, x2, d, f, s = self._observer.state
        gravity = self._gravity
        if self._delayed:
            u = self._ku * self._under_way
            x1, x2, d, _, _, _ = _moved(x1, x2, d, f, s, self._period, u, self._f0, gravity)
        direction = reference.velocity / _CROSSING_RAD_S
        direction = -1.0 if direction < -1.0 else min(direction, 1.0)
        w = d - gravity * math.sin(x1) - f * direction
        x1 = sample.position if self._measured else x1
        return Estimate(x1, x2, w)
