"""The linear extended-state observer: the disturbance is one more state, and one bandwidth sets all gains."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

from dcmp_hil.common.section import Positive
from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS, standing_still
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext


class ExtendedStateTuning(NamedTuple):
    """The key that may change in a run."""

    bandwidth: float  # rad/s


class ExtendedStateSettings(ObserverSettings):
    """`[observer]` with `kind = "extended_state"`."""

    kind: Literal["extended_state"]
    bandwidth_rad_s: Positive = 60.0
    """Of the observer, rad/s: all three poles of its error."""

    def build(self, context: ObserverContext) -> ExtendedState:
        """Make the observer for a rig."""
        return ExtendedState(context, bandwidth=self.bandwidth_rad_s)

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run."""
        return ("bandwidth_rad_s",)

    def tuning(self, context: ObserverContext) -> ExtendedStateTuning:  # noqa: ARG002
        """Return what the observer is retuned with."""
        return ExtendedStateTuning(self.bandwidth_rad_s)


class ExtendedState:
    """Extended-state observer of third order (Han 2009), with the bandwidth as its one gain (Gao 2003).

    It is the current-estimator form: predict x1, x2 over the step with w held, then correct by the new
    sample. All three poles of the error are at b = exp(-w_o T) (Miklosovic, Radke and Gao 2006, eq. 22):

        l1 = 1 - b^3,  l2 = 3/(2T) (1 - b)^2 (1 + b),  l3 = (1 - b)^3 / T^2.

    Viscous friction, a known part of the plant, is in the prediction.

    Parameters
    ----------
    context
        The rig served.
    bandwidth
        w_o, rad/s.
    """

    def __init__(self, context: ObserverContext, *, bandwidth: float = 60.0) -> None:
        self._f0, self._ku = context.model.f0, context.model.ku
        self._restart_after = (GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS) * context.period
        self._bandwidth = bandwidth
        self._t = math.nan
        self._x1 = self._x2 = self._w = 0.0

    def retune(self, tuning: ExtendedStateTuning) -> None:
        """Change the bandwidth; the estimates stay."""
        self._bandwidth = tuning.bandwidth

    def update(self, sample: Sample) -> Estimate:
        """Advance to `sample.t` over the voltage really applied, and correct by its position.

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
            self._advance(step, self._ku * voltage, y)
        else:  # the first sample, or one after a gap too long to bridge
            self._x1, self._x2, self._w = y, 0.0, 0.0
        self._t = t
        return Estimate(self._x1, self._x2, self._w)

    def _advance(self, step: float, u: float, y: float) -> None:
        slope = self._w + u - self._f0 * self._x2
        x1 = self._x1 + step * (self._x2 + 0.5 * step * slope)
        x2 = self._x2 + step * slope
        pole = math.exp(-self._bandwidth * step)
        left = -math.expm1(-self._bandwidth * step)
        e = y - x1
        self._x1 = x1 + (1.0 - pole**3) * e
        self._x2 = x2 + 1.5 * left * left * (1.0 + pole) / step * e
        self._w += left**3 / (step * step) * e
