"""The paper's observer as the paper runs it: eqs. (6)-(8) by explicit Euler, outputs corrected."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from dcmp_hil.common.section import Positive
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.control.observers.stepwise import StepwiseObserver
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.control.observers.settings import ObserverLimits

_LAMBDA1, _LAMBDA2, _LAMBDA3 = 2.0, 1.5, 1.1
_GROWTH_MIN_1_S, _SWING_SHARE_MAX = 0.1, 0.1  # 1/s; of the velocity limit


class PaperSettings(ObserverSettings):
    """`[observer]` with `kind = "paper"`."""

    kind: Literal["paper"] = "paper"
    L1_1_s: Positive = 4.9
    """Copy gain L1 of eq. (14), 1/s."""
    L2_1_s2: Positive = 5.51
    """Copy gain L2 of eq. (14), 1/s2."""
    M_rad_s3: Positive = 1000.0
    """Differentiator gain M of eq. (14), rad/s3."""
    start: Literal["measured", "zero"] = "measured"
    """Initial z1: the first measured position, or 0 as in the paper."""

    def build(self, context: ObserverContext) -> PaperObserver:
        """Make the observer for a rig."""
        return PaperObserver(
            context, L1=self.L1_1_s, L2=self.L2_1_s2, M=self.M_rad_s3, from_zero=self.start == "zero"
        )

    def warning(self, context: ObserverContext) -> str:
        """Return a warning where there is an encoder, which the paper's observer is not made for."""
        if context.counts_per_rev is None:
            return ""
        return (
            f"observer: the paper's Euler observer on an encoder of {context.counts_per_rev:g} counts costs "
            'ten times the voltage variation; kind = "super_twisting" is made for it.'
        )

    def fault(self, context: ObserverContext, limits: ObserverLimits) -> str:
        """Return a fault if the explicit Euler steps diverge, or oscillate by more than the arm does."""
        step, count = context.period, limits.count_rad
        copy = np.array([[-self.L1_1_s, 1.0], [-self.L2_1_s2, -context.model.f0]])
        if np.abs(np.linalg.eigvals(np.eye(2) + step * copy)).max() > 1.0 + _GROWTH_MIN_1_S * step:
            return (
                f"explicit Euler steps of {1e3 * step:g} ms are not stable with these gains. Lower "
                "observer.L1_1_s and observer.L2_1_s2, or raise loop.rate_hz."
            )
        noise = max(self.L1_1_s * count, step * self.L2_1_s2 * count)
        noise += 2.0 * (self.M_rad_s3 * count * count) ** (1 / 3)
        if noise > _SWING_SHARE_MAX * limits.velocity:
            return (
                f"one count of the encoder moves the estimated velocity by {noise:.3g} rad/s, a tenth of "
                "supervisor.velocity_limit_rad_s and more. Lower observer.L1_1_s, observer.L2_1_s2 or "
                "observer.M_rad_s3."
            )
        swing = self.M_rad_s3 * step  # of w_hat in a period
        if swing > limits.torque:
            return (
                f"in explicit Euler steps the estimated disturbance swings by {swing:.3g} rad/s2, more than "
                "the motor has at amplifier.voltage_limit_V. Lower observer.M_rad_s3, or raise loop.rate_hz."
            )
        return ""


class PaperObserver(StepwiseObserver):
    """Super-twisting observer by explicit Euler steps, for the reproduction of the paper.

    Eq. (8) is read with the auxiliary that the paper's misprint hides (it prints v1' twice):

        n1 = -l1 M^(1/3) |v1 - e|^(2/3) sgn(v1 - e) + v2,   v1' = n1,
        n2 = -l2 M^(1/2) |v2 - n1|^(1/2) sgn(v2 - n1) + v3, v2' = n2,
        v3' = -l3 M sgn(v3 - n2).

    Parameters
    ----------
    context
        The rig served.
    L1, L2, M
        Gains of eq. (14): 1/s, 1/s2, rad/s3.
    from_zero
        Begin at z = 0 like the paper instead of at the first measured position.
    """

    def __init__(
        self,
        context: ObserverContext,
        *,
        L1: float = 4.9,
        L2: float = 5.51,
        M: float = 1000.0,
        from_zero: bool = False,
    ) -> None:
        super().__init__(context)
        self.L1, self.L2 = L1, L2
        self._n1_gain = _LAMBDA1 * M ** (1 / 3)
        self._n2_gain = _LAMBDA2 * math.sqrt(M)
        self._n3_gain = _LAMBDA3 * M
        self._from_zero = from_zero
        self._y = math.nan
        self._z1 = self._z2 = 0.0
        self.v1 = self.v2 = self.v3 = 0.0

    def _advance(self, step: float, u: float, y: float) -> Estimate:
        self._euler_step(step, u)  # from the stored position
        self._y = y
        return self._estimate()

    def _restart(self, y: float) -> Estimate:
        first = math.isnan(self._t)
        self._z1, self._z2 = (0.0 if first and self._from_zero else y), 0.0
        self.v1 = self.v2 = self.v3 = 0.0
        self._y = y
        return self._estimate()

    def _estimate(self) -> Estimate:
        return Estimate(self._z1 + self.v1, self._z2 + self.v2 + self.L1 * self.v1, self.disturbance())

    def disturbance(self) -> float:
        """Return w_hat by the corrected eq. (9), rad/s2."""
        return self.v3 + (self.L1 + self._f0) * self.v2 + (self.L2 + self._f0 * self.L1) * self.v1

    def _euler_step(self, dt: float, u: float) -> None:
        e = self._y - self._z1
        v1, v2, v3 = self.v1, self.v2, self.v3
        n1 = v2 - self._n1_gain * math.copysign(abs(v1 - e) ** (2 / 3), v1 - e)
        n2 = v3 - self._n2_gain * math.copysign(math.sqrt(abs(v2 - n1)), v2 - n1)
        n3 = -math.copysign(self._n3_gain, v3 - n2) if v3 != n2 else 0.0
        self.v1, self.v2, self.v3 = v1 + dt * n1, v2 + dt * n2, v3 + dt * n3
        z1, z2 = self._z1, self._z2
        self._z1 = z1 + dt * (z2 + self.L1 * e)
        self._z2 = z2 + dt * (u - self._f0 * z2 + self.L2 * e)
