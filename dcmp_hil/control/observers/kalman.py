"""The plain Kalman filter: the disturbance is a random walk, and the encoder's count is white noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal

from dcmp_hil.common.section import Positive
from dcmp_hil.control.observers.settings import OneGainSettings
from dcmp_hil.control.observers.stepwise import StepwiseObserver
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.control.observers.settings import ObserverLimits

_COUNT_VARIANCE = 1.0 / 12.0  # counts^2, of a value that lies anywhere in its count
_VELOCITY_VARIANCE, _DISTURBANCE_VARIANCE = 1e-8, 100.0  # (rad/s)2, (rad/s2)2; at rest at the start


class KalmanSettings(OneGainSettings):
    """`[observer]` with `kind = "kalman"`."""

    gain: ClassVar = "w_noise"
    kind: Literal["kalman"]
    w_noise: Positive = 10.0
    """Noise of the disturbance's random walk, (rad/s2)2/s: higher is faster, and less quiet."""

    def build(self, context: ObserverContext) -> Kalman:
        """Make the observer for a rig."""
        return Kalman(context, w_noise=self.w_noise)

    def fault(self, context: ObserverContext, limits: ObserverLimits) -> str:  # noqa: ARG002
        """Return a fault on an ideal encoder, whose noise is 0."""
        if context.counts_per_rev is not None:
            return ""
        return (
            "a Kalman filter weighs the model against the encoder's counts, and this encoder is ideal. Set "
            'encoder.counts_per_rev, or observer.kind = "super_twisting".'
        )


class Kalman(StepwiseObserver):
    """Kalman filter of (x1, x2, w) with w' white noise (Simon, Optimal State Estimation, 2006, chapter 5).

        x1' = x2,  x2' = -f0 x2 + w + u,  w' = n.

    The covariance is carried along, so that steps of any length are weighed right. Its discrete noise is
    that of the exact integral over a step (Bar-Shalom, Li and Kirubarajan 2001, section 6.2.2) with f0 = 0.

    Parameters
    ----------
    context
        The rig served; its encoder must have counts.
    w_noise
        Intensity of n, (rad/s2)2/s.
    """

    def __init__(self, context: ObserverContext, *, w_noise: float = 10.0) -> None:
        super().__init__(context)
        count = 2.0 * math.pi / context.counts_per_rev if context.counts_per_rev else 0.0
        self._variance = _COUNT_VARIANCE * count * count
        self._w_noise = w_noise
        self._state = (0.0, 0.0, 0.0)
        self._p = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # P00 P01 P02 P11 P12 P22

    def retune(self, w_noise: float) -> None:
        """Change the noise; the state stays."""
        self._w_noise = w_noise

    def _restart(self, y: float) -> Estimate:
        self._state = (y, 0.0, 0.0)
        self._p = (self._variance, 0.0, 0.0, _VELOCITY_VARIANCE, 0.0, _DISTURBANCE_VARIANCE)
        return Estimate(y, 0.0, 0.0)

    def _advance(self, step: float, u: float, y: float) -> Estimate:
        self._predict(step, u)
        self._correct(y)
        return Estimate(*self._state)

    def _predict(self, step: float, u: float) -> None:
        x1, x2, w = self._state
        slope = w + u - self._f0 * x2
        self._state = (x1 + step * (x2 + 0.5 * step * slope), x2 + step * slope, w)
        p00, p01, p02, p11, p12, p22 = self._p
        half, kept = 0.5 * step * step, 1.0 - self._f0 * step
        a = step - half * self._f0  # of x2 in x1
        g0 = p00 + a * p01 + half * p02
        g1 = p01 + a * p11 + half * p12
        g2 = p02 + a * p12 + half * p22
        h1, h2 = kept * p11 + step * p12, kept * p12 + step * p22
        n = self._w_noise * step
        self._p = (
            g0 + a * g1 + half * g2 + n * step**4 / 20.0,
            kept * g1 + step * g2 + n * step**3 / 8.0,
            g2 + n * half / 3.0,
            kept * h1 + step * h2 + n * step * step / 3.0,
            h2 + n * 0.5 * step,
            p22 + n,
        )

    def _correct(self, y: float) -> None:
        x1, x2, w = self._state
        p00, p01, p02, p11, p12, p22 = self._p
        variance = p00 + self._variance
        k0, k1, k2 = p00 / variance, p01 / variance, p02 / variance
        e = y - x1
        self._state = (x1 + k0 * e, x2 + k1 * e, w + k2 * e)
        self._p = (
            p00 - k0 * p00,
            p01 - k0 * p01,
            p02 - k0 * p02,
            p11 - k1 * p01,
            p12 - k1 * p02,
            p22 - k2 * p02,
        )
