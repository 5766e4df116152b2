"""An observer for every user, as a developer would add it: one bandwidth, tunable in a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from dcmp_hil.common.section import Positive
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext


class LuenbergerSettings(ObserverSettings):
    """`[observer]` with `kind = "luenberger"`."""

    kind: Literal["luenberger"]
    bandwidth_rad_s: Positive = 40.0
    """Bandwidth of the three equal poles, rad/s."""

    def build(self, context: ObserverContext) -> Luenberger:
        """Make the observer for a rig."""
        return Luenberger(context, self.bandwidth_rad_s)

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run."""
        return ("bandwidth_rad_s",)

    def tuning(self, context: ObserverContext) -> float:  # noqa: ARG002
        """Return the bandwidth."""
        return self.bandwidth_rad_s


class Luenberger:
    """Position, velocity and disturbance by explicit Euler steps."""

    def __init__(self, context: ObserverContext, bandwidth: float) -> None:
        self._model, self._bandwidth = context.model, bandwidth
        self._t = math.nan
        self._x = Estimate(0.0, 0.0, 0.0)

    def retune(self, bandwidth: float) -> None:
        """Take another bandwidth, rad/s."""
        self._bandwidth = bandwidth

    def update(self, sample: Sample) -> Estimate:
        """Return the estimate at `sample.t`."""
        step = sample.t - self._t
        x1, x2, w = self._x if step == step else (sample.position, 0.0, 0.0)
        if step == step:
            mu, error = self._bandwidth, sample.position - x1
            drive = w + self._model.ku * sample.voltage - self._model.f0 * x2
            x1 += step * (x2 + 3.0 * mu * error)
            x2 += step * (drive + 3.0 * mu * mu * error)
            w += step * mu**3 * error
        self._t, self._x = sample.t, Estimate(x1, x2, w)
        return self._x
