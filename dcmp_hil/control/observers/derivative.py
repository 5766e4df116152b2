"""The filtered difference: what an encoder gives without a model of the plant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

from dcmp_hil.common.section import Positive
from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS, standing_still
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext


class DerivativeTuning(NamedTuple):
    """The key that may change in a run."""

    bandwidth: float  # rad/s


class DerivativeSettings(ObserverSettings):
    """`[observer]` with `kind = "derivative"`."""

    kind: Literal["derivative"]
    bandwidth_rad_s: Positive = 60.0
    """Corner of the low-pass filter of the difference, rad/s: lower is quieter, and later."""

    def build(self, context: ObserverContext) -> Derivative:
        """Make the observer for a rig."""
        return Derivative(context, bandwidth=self.bandwidth_rad_s)

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run."""
        return ("bandwidth_rad_s",)

    def tuning(self, context: ObserverContext) -> DerivativeTuning:  # noqa: ARG002
        """Return what the observer is retuned with."""
        return DerivativeTuning(self.bandwidth_rad_s)


class Derivative:
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
        self._f0, self._ku = context.model.f0, context.model.ku
        self._restart_after = (GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS) * context.period
        self._bandwidth = bandwidth
        self._t = self._y = math.nan
        self._v = self._u = self._w = 0.0

    def retune(self, tuning: DerivativeTuning) -> None:
        """Change the bandwidth; the estimates stay."""
        self._bandwidth = tuning.bandwidth

    def update(self, sample: Sample) -> Estimate:
        """Advance to `sample.t`.

        Raises
        ------
        ProtocolError
            If device time does not advance.
        """
        t, y, voltage, _ = sample
        step = t - self._t
        if step <= 0.0:
            raise standing_still(self._t, t)
        if step <= self._restart_after:
            share = -math.expm1(-self._bandwidth * step)
            before = self._v
            self._v += share * ((y - self._y) / step - before)
            self._u += share * (self._ku * voltage - self._u)
            w = (self._v - before) / step + self._f0 * self._v - self._u
            self._w += share * (w - self._w)
        else:  # the first sample, or one after a gap too long to bridge
            self._v = self._u = self._w = 0.0
        self._t, self._y = t, y
        return Estimate(y, self._v, self._w)
