"""The filter: predict with friction, measure by edges, judge the innovation, correct."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS, standing_still
from dcmp_hil.control.observers.friction_kalman.covariance import (
    Covariance,
    released,
    slipped,
    stuck,
    widened,
)
from dcmp_hil.control.observers.friction_kalman.motion import moved
from dcmp_hil.control.observers.friction_kalman.trust import (
    FAST_WEIGHT,
    Trust,
    calmed,
    judged,
)
from dcmp_hil.errors import ConfigError
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext

_SLOPE_NOISE, _FRICTION_NOISE, _SLOPE_START = 5.0, 1e-3, 3.0  # (rad/s3)2/s; (rad/s2)2/s; rad/s3
_REVERSAL_NOISE, _REVERSAL_RAD_S = 1.0, 0.06  # (rad/s2)2/s, more of d below so many rad/s
_UNCHANGED_COUNTS = 0.35  # standard deviation of an unchanged count, counts
_FRICTION_MAX_RATIO = 4.0  # of the model's
_RELEASE_GATE = 9.0  # variances: an edge this far off releases an arm that sticks
_STEP_AGE_S, _STEP_DEVIATION_MAX = 0.025, 300.0  # s; rad/s2
_STEP_MEAN_MIN, _STEP_CALM_MAX, _STEP_SPEED_MIN = 30.0, 2.5, 0.1  # chi^2; mean of m; rad/s


class Tuning(NamedTuple):
    """The keys that may change in a run."""

    d_noise: float  # (rad/s2)2/s
    edge_counts: float  # counts


class State(NamedTuple):
    """The state of the filter."""

    x1: float  # rad
    x2: float  # rad/s
    d: float  # rad/s2, disturbance without gravity and friction
    f: float  # rad/s2, Coulomb friction
    s: float  # rad/s3, slope of d


class FrictionKalman:
    """Velocity, disturbance and friction from the encoder's edges.

    A Kalman filter whose prediction can stick. An edge of the encoder is a far better measurement than the
    middle of a count, and the friction's jump at a reversal is part of the model, so neither shows as a
    disturbance. Where the innovations keep one sign the model is wrong, as when a hand moves the arm, and
    the noise of the disturbance is raised until they no longer do.

    Parameters
    ----------
    context
        The rig served: believed plant, period (s), encoder.
    d_noise
        Of the disturbance, (rad/s2)2/s.
    edge_counts
        Standard deviation of an edge's place, counts.
    f1_uncertainty
        Standard deviation of the model's friction, rad/s2; acts at the start.

    Attributes
    ----------
    state, covariance, trust
        After the last sample.
    sticks
        Whether the arm was predicted to stick, and was not seen to move.
    steps
        Number of steps of the disturbance that were assumed since the start.

    Raises
    ------
    ConfigError
        If the encoder is ideal: there are no edges.
    """

    def __init__(
        self,
        context: ObserverContext,
        *,
        d_noise: float = 0.1,
        edge_counts: float = 0.13,
        f1_uncertainty: float = 0.25,
    ) -> None:
        if context.counts_per_rev is None:
            raise ConfigError(
                "friction_kalman measures by the edges of an encoder, and this one is ideal. Set "
                'encoder.counts_per_rev, or use observer.kind = "super_twisting".'
            )
        self._q = q = 2.0 * math.pi / context.counts_per_rev
        model = context.model
        self._f0, self._gravity, self._ku, self._f1 = model.f0, model.gravity, model.ku, model.f1
        self._f_max = _FRICTION_MAX_RATIO * model.f1
        self._f1_variance = f1_uncertainty * f1_uncertainty
        self._restart_after = (GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS) * context.period
        self._unchanged_variance = (_UNCHANGED_COUNTS * q) ** 2
        self.retune(Tuning(d_noise, edge_counts))
        self._t = math.nan
        self._begin(math.nan, math.nan)

    def retune(self, tuning: Tuning) -> None:
        """Change the noises; the state stays."""
        self._d_noise = tuning.d_noise
        self._edge_variance = (tuning.edge_counts * self._q) ** 2

    def update(self, sample: Sample) -> Estimate:
        """Advance to `sample.t` over the voltage really applied, and correct by its count.

        Raises
        ------
        ProtocolError
            If device time does not advance.
        """
        t, y, voltage, _ = sample
        step = t - self._t
        if step <= 0.0:
            raise standing_still(self._t, t)
        if not step <= self._restart_after:  # NaN: the first sample
            return self._begin(t, y)
        self._t = t
        u = self._ku * voltage
        f0, gravity = self._f0, self._gravity
        x1, x2, d, f, s = self.state
        x1, x2, d, s, a, direction = moved(x1, x2, d, f, s, step, u, f0, gravity)
        believed = self.trust
        m, slope_m, calm, _, _, scatter = believed
        d_noise, f_noise = self._d_noise * step * m, _FRICTION_NOISE * step
        if -_REVERSAL_RAD_S < x2 < _REVERSAL_RAD_S:
            d_noise, f_noise = d_noise + _REVERSAL_NOISE * step, f_noise * (30.0 * m - 29.0)
        noise = d_noise, f_noise, _SLOPE_NOISE * step * slope_m
        if direction:
            p = slipped(self.covariance, x1, direction, step, f0, gravity, noise)
        else:
            p = stuck(self.covariance, step, noise)

        # Measure: the newest edge, if the count changed; else only how far the arm is outside of its count.
        q = self._q
        self._since_edge += step
        count = round((y - self._first) / q)
        edge = count != self._count
        e = h = 0.0
        if edge:
            speed = abs(x2)
            span = q / speed if speed * step > q else step
            passed = y - 0.5 * q if count > self._count else y + 0.5 * q
            e, h = passed - (x1 - 0.5 * span * x2), -0.5 * span
            r = scatter * self._edge_variance + (x2 * span) ** 2 / 12.0
            if not direction and e * e > _RELEASE_GATE * (p[0] + r):
                d = f - (a - d) if e > 0.0 else -f - (a - d)
                x2 = 0.5 * e / max(self._since_edge, 2.0 * step)
                p, direction = released(p, e, x2, f), 1.0
            self._count, self._since_edge = count, 0.0
        else:
            r = scatter * self._unchanged_variance
            if y - x1 > 0.5 * q:
                e = y - x1 - 0.5 * q
            elif y - x1 < -0.5 * q:
                e = y - x1 + 0.5 * q

        if edge or e:
            # Judge.
            p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, p23, p24, p33, p34, p44 = p
            variance = p00 + h * (2.0 * p01 + h * p11) + r
            nu = e / math.sqrt(variance)
            trust = judged(believed, nu, step, edge=edge)
            fast = trust[4]
            if (
                FAST_WEIGHT * fast * fast > _STEP_MEAN_MIN
                and nu * fast > 0.0
                and nu * nu > 1.0
                and abs(x2) >= _STEP_SPEED_MIN
                and calm < _STEP_CALM_MAX
            ):
                p, trust = _stepped(p, e, h, variance), trust._replace(fast=0.5 * fast)
                p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, p23, p24, p33, p34, p44 = p
                variance = p00 + h * (2.0 * p01 + h * p11) + r
                self.steps += 1

            # Correct.
            h0, h1, h2, h3, h4 = p00 + h * p01, p01 + h * p11, p02 + h * p12, p03 + h * p13, p04 + h * p14
            k0, k1, k2, k3, k4 = h0 / variance, h1 / variance, h2 / variance, h3 / variance, h4 / variance
            # fmt: off
            p = (
                p00 - k0 * h0, p01 - k0 * h1, p02 - k0 * h2, p03 - k0 * h3, p04 - k0 * h4,
                p11 - k1 * h1, p12 - k1 * h2, p13 - k1 * h3, p14 - k1 * h4,
                p22 - k2 * h2, p23 - k2 * h3, p24 - k2 * h4, p33 - k3 * h3, p34 - k3 * h4, p44 - k4 * h4,
            )
            # fmt: on
            x1, x2, d, f, s = x1 + k0 * e, x2 + k1 * e, d + k2 * e, f + k3 * e, s + k4 * e
            f = 0.0 if f < 0.0 else min(self._f_max, f)
        else:
            trust = calmed(believed, step)

        # Report.
        self.state, self.covariance, self.trust = make(State, (x1, x2, d, f, s)), p, trust
        self.sticks = not direction
        w = d - gravity * math.sin(x1) - (f if x2 > 0.0 else -f) if x2 else -u
        return make(Estimate, (x1, x2, w))

    def _begin(self, t: float, y: float) -> Estimate:
        """Begin at rest where the arm is, as if nothing had been seen before."""
        q = self._q
        self._t, self._first = t, y
        self._count, self._since_edge = 0, 0.0
        self.state = State(y, 0.0, 0.0, self._f1, 0.0)
        start = (q * q / 12.0, 1e-8, 1.0, self._f1_variance, _SLOPE_START**2)
        self.covariance: Covariance = (
            *(start[0], 0.0, 0.0, 0.0, 0.0, start[1], 0.0, 0.0, 0.0),
            *(start[2], 0.0, 0.0, start[3], 0.0, start[4]),
        )
        self.trust, self.sticks, self.steps = Trust(), False, 0
        return Estimate(y, 0.0, 0.0)


def _stepped(p: Covariance, e: float, h: float, variance: float) -> Covariance:
    """Return P so wide that a step of the disturbance, a while ago, explains the innovation `e`."""
    half = 0.5 * _STEP_AGE_S * _STEP_AGE_S
    seen = max(half + h * _STEP_AGE_S, 0.5 * half)
    return widened(p, _STEP_AGE_S, min((e * e - variance) / (seen * seen), _STEP_DEVIATION_MAX**2))
