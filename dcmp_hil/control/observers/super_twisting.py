"""The default observer: Luenberger copy and super-twisting differentiator, both discretised exactly."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple

from pydantic import Field

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.common.section import NotNegative, Positive
from dcmp_hil.control.elementary import inverse_cube_root
from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS, standing_still
from dcmp_hil.control.observers.discretisation import (
    ObserverGains,
    luenberger_copy,
    matched_gains,
    plain_gains,
)
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.control.observers.settings import ObserverLimits

_WATCH_BANDWIDTH_RATIO, _WATCH_BANDWIDTH_MAX_RAD_S = 2.5, 100.0  # times the rule; rad/s
_MU0_RULE_RATIO_MAX = 3.0
_BANDWIDTH_MIN_RAD_S = 4.0
"""Rad/s, of the floor: below it an arm that is led to its limits overshoots them."""
_INNOVATION_MIN_RAD, _SLOPE_MIN_RAD_S3 = 1e-30, 1e-30  # below either no sliding bandwidth is defined

_Step = tuple[float, float, float, float, float, float, float, float, float, float, float]
"""f12 f22 gu1 gu2 h01 h02 h11 h12 of the copy in differences, and k1, k2 / T, k3 / T^2."""


class Tuning(NamedTuple):
    """Constants derived from gains, model and period; computed once, and small enough to be sent."""

    L1: float  # 1/s
    L2: float  # 1/s2
    M: float  # rad/s3
    mu0: float  # rad/s
    nominal: _Step
    gaps: dict[int, _Step]  # by the number of periods


class SuperTwistingSettings(ObserverSettings):
    """`[observer]` with `kind = "super_twisting"`."""

    kind: Literal["super_twisting"] = "super_twisting"
    L1_1_s: Positive = 4.9
    """Copy gain L1 of eq. (14), 1/s."""
    L2_1_s2: Positive = 5.51
    """Copy gain L2 of eq. (14), 1/s2."""
    M_rad_s3: NotNegative | None = None
    """Bound on the slope of w, rad/s3; by default 15, and 1000 for an ideal encoder. 0 = linear."""
    mu0_rad_s: NotNegative | None = Field(default=None)
    """Bandwidth floor, rad/s: the quiet/fast knob; by default from encoder and rate. 0 = no floor."""

    def tuning(self, context: ObserverContext) -> Tuning:
        """Work out what an observer of that rig is retuned with."""
        return tune(context, L1=self.L1_1_s, L2=self.L2_1_s2, M=self.M_rad_s3, mu0=self.mu0_rad_s)

    def tuning_of_a_period(self, context: ObserverContext) -> Tuning:
        """Work out the same for cycles without gaps, in a tenth of the time."""
        return tune(context, L1=self.L1_1_s, L2=self.L2_1_s2, M=self.M_rad_s3, mu0=self.mu0_rad_s, longest=1)

    def build(self, context: ObserverContext) -> SuperTwisting:
        """Make the observer for a rig."""
        return SuperTwisting(context, L1=self.L1_1_s, L2=self.L2_1_s2, M=self.M_rad_s3, mu0=self.mu0_rad_s)

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run."""
        return ("mu0_rad_s", "M_rad_s3", "L1_1_s", "L2_1_s2")

    def by_rule(self, name: str, context: ObserverContext) -> float | None:
        """Return what the rule makes of a key that was left out; None where there is no rule."""
        if name == "mu0_rad_s":
            return bandwidth_floor(context.counts_per_rev, context.period)
        return slope_bound(context.counts_per_rev) if name == "M_rad_s3" else None

    def warning(self, context: ObserverContext) -> str:
        """Return a warning of a floor that is far from the rule's."""
        if self.mu0_rad_s is None:
            return ""
        usual = bandwidth_floor(context.counts_per_rev, context.period)
        if self.mu0_rad_s == 0.0:
            return "observer.mu0_rad_s = 0: without its floor the loop runs away on a motor 25 % too strong."
        if not usual / _MU0_RULE_RATIO_MAX <= self.mu0_rad_s <= usual * _MU0_RULE_RATIO_MAX:
            return f"observer.mu0_rad_s = {self.mu0_rad_s:g} is far from the rule's {usual:.3g} rad/s."
        return ""

    def fault(self, context: ObserverContext, limits: ObserverLimits) -> str:
        """Return a fault if the differentiator can follow gravity neither by its floor nor by its slope."""
        if self.mu0_rad_s is None or self.mu0_rad_s >= _BANDWIDTH_MIN_RAD_S:
            return ""
        slope = slope_bound(context.counts_per_rev) if self.M_rad_s3 is None else self.M_rad_s3
        fastest = context.model.gravity * limits.velocity
        if fastest <= slope:
            return ""
        return (
            f"a floor below {_BANDWIDTH_MIN_RAD_S:g} rad/s does not follow what gravity does to "
            "an arm that moves fast, and it passes its limits. Raise observer.mu0_rad_s, or leave it out; "
            f"where the encoder is fine enough, observer.M_rad_s3 = {fastest:.4g}, gravity times "
            "supervisor.velocity_limit_rad_s, does it too."
        )


def bandwidth_floor(counts_per_rev: float | None, period: float) -> float:
    """Return the default mu0, rad/s: wider for a finer encoder and a faster loop.

    Parameters
    ----------
    counts_per_rev
        Encoder counts a revolution; None (ideal) takes the largest value that the period allows.
    period
        s; mu0 T never exceeds 0.3.
    """
    largest = 0.3 / period
    if counts_per_rev is None:
        return largest
    usual = 40.0 * inverse_cube_root(4096.0 / counts_per_rev) * math.sqrt(inverse_cube_root(period / 1e-3))
    return min(usual, largest)


def watch_floor(counts_per_rev: float | None, period: float) -> float:
    """Return mu0 of the observer that watches, rad/s: 2.5 times the rule, and no faster than at 4096 counts.

    One count of the encoder shows as a disturbance of about mu0^2 counts: an observer as fast as that on a
    coarse encoder would take the encoder's own steps for a push.
    """
    return min(
        _WATCH_BANDWIDTH_MAX_RAD_S,
        0.3 / period,
        _WATCH_BANDWIDTH_RATIO * bandwidth_floor(counts_per_rev, period),
    )


def slope_bound(counts_per_rev: float | None) -> float:
    """Return the default M, rad/s3: 15 with an encoder, 1000 (the paper's) with an ideal one."""
    return 1000.0 if counts_per_rev is None else 15.0


class SuperTwisting:
    """Velocity and disturbance from position alone.

    A copy z of the plant (eq. 6) leaves the error e = y - z1; a third-order sliding-mode differentiator
    (eq. 8, Levant 2003) estimates e, e' and e'' as v1, v2, v3; the corrected identities give

        x1_hat = z1 + v1,  x2_hat = z2 + v2 + L1 v1,
        w_hat  = v3 + (L1 + f0) v2 + (L2 + f0 L1) v1.

    Both halves are solved exactly over each step, the differentiator by matching its eigenvalues
    (Koch and Reichhartinger 2019) at the bandwidth mu = max(mu0, (M / |b|)^(1/3)). The floor mu0 is this
    project's own: without it the loop runs away when the motor gain is 25 % above the model's.

    Parameters
    ----------
    context
        The rig served: believed plant, period (s), encoder.
    L1, L2
        Gains of the copy, 1/s and 1/s2.
    M
        Bound on |w'|-like slopes, rad/s3; None takes `slope_bound`.
    mu0
        rad/s; None takes `bandwidth_floor`.
    """

    def __init__(
        self,
        context: ObserverContext,
        *,
        L1: float = 4.9,
        L2: float = 5.51,
        M: float | None = None,
        mu0: float | None = None,
    ) -> None:
        self._period = context.period
        self._tolerance = STEP_TOLERANCE_PERIODS * context.period
        self._shortest, self._longest = self._period - self._tolerance, self._period + self._tolerance
        self._f0, self._ku = context.model.f0, context.model.ku
        self._use(tune(context, L1=L1, L2=L2, M=M, mu0=mu0))
        self._t = self._y = math.nan
        self._z1 = self._z2 = self._v1 = self._v2 = self._v3 = 0.0

    def update(self, sample: Sample) -> Estimate:
        """Advance to `sample.t` over the voltage really applied, and correct by its position.

        Raises
        ------
        ProtocolError
            If device time does not advance.
        """
        t, y, voltage, _ = sample
        dt = t - self._t
        step = self._nominal if self._shortest < dt < self._longest else self._step(dt)
        if step is None:
            return self._restart(t, y)
        f12, f22, gu1, gu2, h01, h02, h11, h12, k1, k2, k3 = step
        u = self._ku * voltage
        z1, z2, v2, v3 = self._z1, self._z2, self._v2, self._v3
        # In differences: y at rest and z1 = y is a rest to the last bit, in single precision as well.
        e0, e1 = self._y - z1, y - z1
        z1 += h01 * e0 + h11 * e1 + f12 * z2 + gu1 * u
        z2 = f22 * z2 + gu2 * u + h02 * e0 + h12 * e1
        v1 = self._v1 + dt * (v2 + 0.5 * dt * v3)
        v2 = v2 + dt * v3
        b = y - z1 - v1
        if not abs(b) >= self._floor_from:
            k1, k2, k3 = self._sliding_gains(b, dt)
        self._v1 = v1 = v1 + k1 * b
        self._v2 = v2 = v2 + k2 * b
        self._v3 = v3 = v3 + k3 * b
        self._t, self._y, self._z1, self._z2 = t, y, z1, z2
        # 0.09 us less than the constructor
        return make(Estimate, (z1 + v1, z2 + v2 + self._L1 * v1, v3 + self._w2 * v2 + self._w1 * v1))

    def retune(self, tuning: Tuning) -> None:
        """Change the gains; keep the estimates of position, velocity, disturbance and its slope.

        e = y - z1 obeys e'' + (L1 + f0) e' + (L2 + f0 L1) e = w. Under another L1 or L2 the present e would
        be far from where w leads it, and the way there faster than the differentiator can follow: the copy
        is moved to where e has arrived.
        """
        v1, v2, v3 = self._v1, self._v2, self._v3
        x1, x2 = self._z1 + v1, self._z2 + v2 + self._L1 * v1
        w, slope = v3 + self._w2 * v2 + self._w1 * v1, self._w2 * v3 + self._w1 * v2
        same = (tuning.L1, tuning.L2) == (self._L1, self._L2)
        self._use(tuning)
        if same:
            return
        self._v2, self._v3 = slope / self._w1, 0.0
        self._v1 = (w - self._w2 * self._v2) / self._w1
        self._z1, self._z2 = x1 - self._v1, x2 - self._v2 - self._L1 * self._v1

    def _use(self, tuning: Tuning) -> None:
        self._L1, self._L2, self.M, self.mu0, self._nominal, self._gaps = tuning
        self._w1, self._w2 = self._L2 + self._f0 * self._L1, self._L1 + self._f0
        # An innovation at least this large is slower than the floor.
        cube = self.mu0 * self.mu0 * self.mu0  # 0 of a floor so small that it is none
        self._floor_from = self.M / cube if cube > 0.0 else math.inf

    def _restart(self, t: float, y: float) -> Estimate:
        """Begin at rest where the arm is: never at 0, which would be a step of the whole position."""
        self._t, self._y, self._z1, self._z2 = t, y, y, 0.0
        self._v1 = self._v2 = self._v3 = 0.0
        return Estimate(y, 0.0, 0.0)

    def _step(self, dt: float) -> _Step | None:
        """Return the coefficients for a step of another length; None if the state cannot be continued."""
        if dt <= 0.0:
            raise standing_still(self._t, self._t + dt)
        if not dt < GAP_PERIODS_MAX * self._period + self._tolerance:  # NaN: the first sample
            return None
        n = round(dt / self._period)
        if n in self._gaps and abs(dt - n * self._period) < self._tolerance:
            return self._gaps[n]
        return _solve(dt, self._f0, self._L1, self._L2, self.mu0)

    def _sliding_gains(self, b: float, dt: float) -> tuple[float, float, float]:
        """Gains of an innovation so small that the sliding term is faster than the floor."""
        size, M, mu = abs(b), self.M, self.mu0
        if size >= _INNOVATION_MIN_RAD and M >= _SLOPE_MIN_RAD_S3:
            mu = inverse_cube_root(size / M)
        k1, k2, k3 = plain_gains(mu * dt)
        return k1, k2 / dt, k3 / (dt * dt)


@lru_cache(maxsize=64)  # the observer that watches is the same in every run of a rig
def tune(
    context: ObserverContext,
    *,
    L1: float,
    L2: float,
    M: float | None,
    mu0: float | None,
    longest: int = GAP_PERIODS_MAX,
) -> Tuning:
    """Work out every coefficient of an observer; the arguments are those of `SuperTwisting`.

    `longest` is the longest step, in periods, that has coefficients of its own.
    """
    counts, period, f0 = context.counts_per_rev, context.period, context.model.f0
    M = slope_bound(counts) if M is None else M
    mu0 = bandwidth_floor(counts, period) if mu0 is None else mu0
    gaps = {n: _solve(n * period, f0, L1, L2, mu0) for n in range(1, longest + 1)}
    return Tuning(L1, L2, M, mu0, gaps.pop(1), gaps)


def _solve(dt: float, f0: float, L1: float, L2: float, mu0: float) -> _Step:
    """Return the constants that depend on the step alone, as one tuple."""
    return (*luenberger_copy(dt, f0, L1, L2).differences(), *_per_step(matched_gains(mu0 * dt), dt))


def _per_step(gains: ObserverGains, dt: float) -> ObserverGains:
    """Scale to what b itself is multiplied with: v2 += k2 b / T, v3 += k3 b / T^2."""
    return ObserverGains(gains.k1, gains.k2 / dt, gains.k3 / (dt * dt))
