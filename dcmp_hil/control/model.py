"""The pendulum as numbers: what observer and controller believe of it, and what the simulation is."""

from __future__ import annotations

import math
from typing import NamedTuple

from dcmp_hil.control.elementary import sine


class Model(NamedTuple):
    """Parameters of eqs. (1)-(4), all over the inertia J.

    Parameters
    ----------
    f0
        1/s, viscous friction fd/J.
    f1
        rad/s2, Coulomb friction fc/J.
    gravity
        rad/s2, gmL/J.
    ku
        (rad/s2)/V, ku/J.
    eta, eta_amplitude, eta_rate
        rad/s2, rad/s2, rad/s: the external disturbance eta/J = eta + eta_amplitude sin(eta_rate t), eq. (13).
    """

    f0: float = 0.1
    f1: float = 1.3
    gravity: float = 14.03
    ku: float = 5.4
    eta: float = 0.84
    eta_amplitude: float = 0.2
    eta_rate: float = 0.2

    def external(self, t: float) -> float:
        """Return eta/J at time `t`, rad/s2."""
        return self.eta + self.eta_amplitude * sine(self.eta_rate * t)


class PlantDetails(NamedTuple):
    """Properties of a simulated motor beyond the model."""

    stribeck_ratio: float  # friction at rest over that in motion, minus 1
    stribeck: float  # rad/s
    bristle: float  # rad, deflection at which it breaks away; 0 sticks
    cogging: float  # rad/s2
    cogging_per_rev: int


UNKNOWN_MODEL = Model(*[math.nan] * len(Model._fields))
