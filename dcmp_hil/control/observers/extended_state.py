"""The linear extended-state observer: the disturbance is one more state, and one bandwidth sets all gains."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal

from dcmp_hil.common.section import Positive
from dcmp_hil.control.observers.settings import OneGainSettings
from dcmp_hil.control.observers.stepwise import StepwiseObserver
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext


class ExtendedStateSettings(OneGainSettings):
    """`[observer]` with `kind = "extended_state"`."""

    gain: ClassVar = "bandwidth_rad_s"
    kind: Literal["extended_state"]
    bandwidth_rad_s: Positive = 60.0
    """Of the observer, rad/s: all three poles of its error."""

    def build(self, context: ObserverContext) -> ExtendedState:
        """Make the observer for a rig."""
        return ExtendedState(context, bandwidth=self.bandwidth_rad_s)


class ExtendedState(StepwiseObserver):
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
        super().__init__(context)
        self._bandwidth = bandwidth
        self._x1 = self._x2 = self._w = 0.0

    def retune(self, bandwidth: float) -> None:
        """Change the bandwidth; the estimates stay."""
        self._bandwidth = bandwidth

    def _advance(self, step: float, u: float, y: float) -> Estimate:
        slope = self._w + u - self._f0 * self._x2
        x1 = self._x1 + step * (self._x2 + 0.5 * step * slope)
        x2 = self._x2 + step * slope
        pole = math.exp(-self._bandwidth * step)
        left = -math.expm1(-self._bandwidth * step)
        e = y - x1
        self._x1 = x1 + (1.0 - pole**3) * e
        self._x2 = x2 + 1.5 * left * left * (1.0 + pole) / step * e
        self._w += left**3 / (step * step) * e
        return Estimate(self._x1, self._x2, self._w)

    def _restart(self, y: float) -> Estimate:
        self._x1, self._x2, self._w = y, 0.0, 0.0
        return Estimate(y, 0.0, 0.0)
