"""Base of the observers that advance by one step a sample, of any length, and begin again after a gap."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS, standing_still

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.values import Estimate, Sample


class StepwiseObserver(ABC):
    """An observer whose step is checked before it is taken.

    Parameters
    ----------
    context
        The rig served.
    """

    def __init__(self, context: ObserverContext) -> None:
        self._f0, self._ku = context.model.f0, context.model.ku
        self._restart_after = (GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS) * context.period  # s
        self._t = math.nan

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
            estimate = self._advance(step, self._ku * voltage, y)
        else:  # the first sample (the step is NaN), or one after a gap too long to bridge
            estimate = self._restart(y)
        self._t = t
        return estimate

    @abstractmethod
    def _advance(self, step: float, u: float, y: float) -> Estimate:
        """Advance by `step`, s, over the input u, rad/s2, to the position y, rad."""

    @abstractmethod
    def _restart(self, y: float) -> Estimate:
        """Begin at rest at the position y, rad."""
