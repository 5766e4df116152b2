"""The filter: predict with friction, measure by edges, judge the innovation, correct."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.control.elementary import sine
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
    BELIEVED,
    calmed,
    halved,
    judged,
    stepped,
)
from dcmp_hil.errors import ConfigError
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext

State = tuple[float, float, float, float, float]
"""x1 (rad), x2 (rad/s), d without gravity and friction, Coulomb level f (rad/s2), slope s of d (rad/s3)."""

_VELOCITY_VARIANCE, _DISTURBANCE_VARIANCE, _SLOPE_DEVIATION = 1e-8, 1.0, 3.0  # at the start
_SLOPE_NOISE, _FRICTION_NOISE = 5.0, 1e-3  # (rad/s3)2/s; (rad/s2)2/s
_REVERSAL_NOISE, _REVERSAL_RAD_S = 1.0, 0.06  # (rad/s2)2/s, more of d below so many rad/s
_UNCHANGED_COUNTS = 0.35  # standard deviation of an unchanged count, counts
_FRICTION_MAX_RATIO = 4.0  # of the model's
_FRICTION_VARIANCE = 12  # place in the covariance
_RELEASE_GATE = 9.0  # variances: an edge this far off releases an arm that sticks
_STEP_AGE_S, _STEP_DEVIATION_MAX = 0.025, 300.0  # s; rad/s2
_STEP_CALM_MAX, _STEP_SPEED_MIN_RAD_S = 2.5, 0.1  # mean of m


class FrictionKalmanTuning(NamedTuple):
    """The keys that may change in a run."""

    d_noise: float  # (rad/s2)2/s
    edge_counts: float  # counts


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

    DIAGNOSIS: ClassVar[tuple[str, ...]] = (
        "disturbance_found_rad_s2",  # d
        "friction_found_rad_s2",  # f
        "friction_deviation_rad_s2",  # square root of its variance
        "slope_found_rad_s3",  # s
        "distrust",  # m: times the noise of d
        "edge_scatter",  # rho: times the variance of an edge
        "stuck",  # 1 where the arm was predicted to stick, and was not seen to move
        "disturbance_steps",  # that were assumed since the start
    )

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
        self._q = 2.0 * math.pi / context.counts_per_rev
        self._half_count = 0.5 * self._q
        model = context.model
        self._f0, self._gravity, self._ku, self._f1 = model.f0, model.gravity, model.ku, model.f1
        self._f_max = _FRICTION_MAX_RATIO * model.f1
        self._f1_variance = f1_uncertainty * f1_uncertainty
        self._restart_after = (GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS) * context.period
        unchanged = _UNCHANGED_COUNTS * self._q
        self._unchanged_variance = unchanged * unchanged
        self.retune(FrictionKalmanTuning(d_noise, edge_counts))
        self._t = self._y = self._first = self._edge_t = math.nan
        self._count = self.steps = 0
        self.sticks = False
        self.trust = BELIEVED
        self.state: State = (math.nan, math.nan, math.nan, self._f1, 0.0)
        self.covariance: Covariance = (math.nan,) * 5 + (math.nan,) * 10

    def diagnose(self) -> tuple[float, ...]:
        """Return the state beside position and velocity, and how far it is to be trusted; see `DIAGNOSIS`."""
        _, _, d, f, s = self.state
        variance, trust = self.covariance[_FRICTION_VARIANCE], self.trust
        deviation = math.sqrt(variance) if variance > 0.0 else 0.0
        return d, f, deviation, s, trust[0], trust[5], float(self.sticks), float(self.steps)

    @property
    def constants(self) -> tuple[float, ...]:
        """Constants of rig and noises, as `struct dcmp_friction_setup` of the core."""
        return (
            *(self._f0, self._gravity, self._ku, self._f1, self._f_max, self._f1_variance, self._q),
            *(self._half_count, self._restart_after, self._unchanged_variance),
            *(self._edge_variance, self._d_noise),
        )

    def retune(self, tuning: FrictionKalmanTuning) -> None:
        """Change the noises; the state stays."""
        self._d_noise = tuning.d_noise
        edge = tuning.edge_counts * self._q
        self._edge_variance = edge * edge

    def update(self, sample: Sample) -> Estimate:
        """Advance to `sample.t` over the voltage really applied, and correct by its count.

        Raises
        ------
        ProtocolError
            If device time does not advance.
        """
        t, y, voltage, _ = sample
        step = t - self._t
        if not 0.0 < step <= self._restart_after:
            return self._begin(t, y)
        u, f0, gravity = self._ku * voltage, self._f0, self._gravity
        x1, x2, d, f, s = self.state
        if (x1 + x2 + y + voltage) * 0.0 != 0.0:  # not finite; math.isfinite takes 0.03 us more
            return self._lose(t)
        x1, x2, d, s, a, direction = moved(x1, x2, d, f, s, step, u, f0, gravity)

        m, slope_m, _, _, _, scatter = trust = self.trust
        d_noise, f_noise = self._d_noise * step * m, _FRICTION_NOISE * step
        if -_REVERSAL_RAD_S < x2 < _REVERSAL_RAD_S:
            d_noise, f_noise = d_noise + _REVERSAL_NOISE * step, f_noise * (30.0 * m - 29.0)
        noise = d_noise, f_noise, _SLOPE_NOISE * step * slope_m
        if direction:
            p = slipped(self.covariance, x1, direction, step, f0, gravity, noise)
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
            self.covariance, self.trust = p, calmed(trust, step)

        self.state = x1, x2, d, f, s
        w = d - gravity * sine(x1) - (f if x2 > 0.0 else -f) if x2 else -u
        return make(Estimate, (x1, x2, w))  # 0.09 us less

    def _begin(self, t: float, y: float) -> Estimate:
        """Begin at rest where the arm is, as if nothing had been seen before."""
        if t <= self._t:
            raise standing_still(self._t, t)
        q = self._q
        self._t, self._y, self._first = t, y, y
        self._count, self._edge_t = 0, t
        self.state = y, 0.0, 0.0, self._f1, 0.0
        # fmt: off
        self.covariance = (
            q * q / 12.0, 0.0, 0.0, 0.0, 0.0,
            _VELOCITY_VARIANCE, 0.0, 0.0, 0.0,
            _DISTURBANCE_VARIANCE, 0.0, 0.0,
            self._f1_variance, 0.0, _SLOPE_DEVIATION * _SLOPE_DEVIATION,
        )
        # fmt: on
        self.trust, self.sticks, self.steps = BELIEVED, False, 0
        return Estimate(y, 0.0, 0.0)

    def _lose(self, t: float) -> Estimate:
        """Estimate no number from here on, as R1: one that came was not finite."""
        self._t = t
        self.state = (math.nan,) * 5
        return Estimate(math.nan, math.nan, math.nan)

    def _rise(self, y: float) -> int:
        """Take the count at `y`, rad, and return by how many it rose."""
        count = round((y - self._first) / self._q)
        rise, self._count = count - self._count, count
        return rise

    def _by_edge(self, x: State, p: Covariance, a: float, rise: int, step: float) -> State:
        """Measure by the newest edge that was passed; an arm that stuck is released by it."""
        x1, x2, d, f, s = x
        q, speed = self._q, abs(x2)
        span = q / speed if speed * step > q else step
        passed = self._y - (self._half_count if rise > 0 else -self._half_count)
        e, h = passed - x1 + 0.5 * span * x2, -0.5 * span
        travel = x2 * span
        r = self.trust[5] * self._edge_variance + travel * travel / 12.0
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
        """Judge an innovation, and correct by it.

        Parameters
        ----------
        x, p
            As predicted.
        measured
            The innovation e, rad; H = (1, h, 0, 0, 0), h in s; its variance R, rad2.
        step
            s.
        edge
            Whether the count changed.
        """
        e, h, r = measured
        variance = p[0] + h * (2.0 * p[1] + h * p[5]) + r
        nu = e / math.sqrt(variance)
        trust = judged(self.trust, nu, step, edge)
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
    """Return P so wide that a step of the disturbance, a while ago, explains the innovation `e`."""
    half = 0.5 * _STEP_AGE_S * _STEP_AGE_S
    seen = max(half + h * _STEP_AGE_S, 0.5 * half)
    return widened(
        p, _STEP_AGE_S, min((e * e - variance) / (seen * seen), _STEP_DEVIATION_MAX * _STEP_DEVIATION_MAX)
    )
