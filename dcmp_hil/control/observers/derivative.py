"""The filtered difference: what an encoder gives without a model of the plant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal

from dcmp_hil.common.section import Positive
from dcmp_hil.control.observers.settings import OneGainSettings
from dcmp_hil.control.observers.stepwise import StepwiseObserver
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext


class DerivativeSettings(OneGainSettings):
    """`[observer]` with `kind = "derivative"`."""

    gain: ClassVar = "bandwidth_rad_s"
    kind: Literal["derivative"]
    bandwidth_rad_s: Positive = 60.0
    """Corner of the low-pass filter of the difference, rad/s: lower is quieter, and later."""

    def build(self, context: ObserverContext) -> Derivative:
        """Make the observer for a rig."""
        return Derivative(context, bandwidth=self.bandwidth_rad_s)


class Derivative(StepwiseObserver):
    """Velocity by a difference and a low-pass filter of first order; the disturbance by the same again.

    With the filter G(s) = b / (s + b), sampled by its exact pole exp(-b T) (Astrom and Wittenmark,
    Computer-Controlled Systems, 1997, section 8.3):

        x2_hat = G s y,   w_hat = G (s x2_hat + f0 x2_hat - G u).

    The input passes G twice, as often as the position does: else w_hat would answer to every change of u.

    Parameters
    ----------
    context
        The rig served.
    bandwidth
        b, rad/s.
    """

    def __init__(self, context: ObserverContext, *, bandwidth: float = 60.0) -> None:
        super().__init__(context)
        self._bandwidth = bandwidth
        self._y = math.nan
        self._v = self._u = self._w = 0.0

    def retune(self, bandwidth: float) -> None:
        """Change the bandwidth; the estimates stay."""
        self._bandwidth = bandwidth

    def _advance(self, step: float, u: float, y: float) -> Estimate:
        share = -math.expm1(-self._bandwidth * step)
        before = self._v
        self._v += share * ((y - self._y) / step - before)
        self._u += share * (u - self._u)
        w = (self._v - before) / step + self._f0 * self._v - self._u
        self._w += share * (w - self._w)
        self._y = y
        return Estimate(y, self._v, self._w)

    def _restart(self, y: float) -> Estimate:
        self._y = y
        self._v = self._u = self._w = 0.0
        return Estimate(y, 0.0, 0.0)
