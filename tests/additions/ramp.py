"""A reference for every user, as a developer would add it."""

import math
from typing import Literal

from dcmp_hil.common.section import Positive
from dcmp_hil.control.references import ReferenceSettings
from dcmp_hil.values import Reference


class Approach(ReferenceSettings):
    """An exponential approach to a position."""

    kind: Literal["approach"]
    position_rad: float = 0.4
    """Where it ends, rad."""
    time_constant_s: Positive = 1.0
    """Time constant, s."""

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""
        left = self.position_rad * math.exp(-max(t, 0.0) / self.time_constant_s)
        rate = 1.0 / self.time_constant_s
        return Reference(self.position_rad - left, rate * left, -rate * rate * left)
