"""The pendulum with properties of a real motor: Stribeck friction, soft friction, cogging."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.control.elementary import exponential, sine
from dcmp_hil.values import Truth

if TYPE_CHECKING:
    from dcmp_hil.control.model import Model, PlantDetails


class DetailedPlant:
    """Moreau's time-stepping as in `MoreauPlant`, or bristles in its place, and cogging.

    The level of friction is f(v) = f1 (1 + ratio exp(-(v/v_s)^2)), after Stribeck. Without bristles it is a
    set, and the arm sticks. With them it is soft (LuGre; Canudas de Wit et al. 1995): their deflection z and
    friction F obey

        z' = v - s0 |v| z / f(v),  F = s0 z + s1 z',  s0 = f1 / bristle, s1 = sqrt(s0),

    with z taken implicitly, so that the step may be longer than the bristles are fast.

    Parameters
    ----------
    plant, model, position, step, steps
        As for `MoreauPlant`.
    details
        Of the rig.
    """

    def __init__(
        self,
        plant: Model,
        model: Model,
        details: PlantDetails,
        *,
        position: float,
        step: float,
        steps: int,
    ) -> None:
        self._plant, self._details = plant, details
        self._f0, self._ku = model.f0, model.ku
        self._step, self._steps = step, steps
        self._periods = 0
        self._x1, self._x2, self._deflection = position, 0.0, 0.0

    def advance(self, voltage: float) -> Truth:
        """Hold `voltage` (V) for one period and return the state at its end."""
        plant, h = self._plant, self._step
        held = plant.external(self._periods * self._steps * h) + plant.ku * voltage
        before = self._x2
        for _ in range(self._steps):
            before = self._x2
            pull = plant.gravity * sine(self._x1) + self._cogging()
            free = before + h * (held - plant.f0 * before - pull)
            self._x2 = self._slowed(free)
            self._x1 += h * self._x2
        self._periods += 1
        slope = (self._x2 - before) / h
        return Truth(self._x1, self._x2, slope + self._f0 * before - self._ku * voltage)

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        self._step *= factor

    def _cogging(self) -> float:
        return self._details.cogging * sine(self._details.cogging_per_rev * self._x1)

    def _slowed(self, free: float) -> float:
        """Return the velocity after a step, rad/s, from what it would be without Coulomb friction."""
        h, details, f1 = self._step, self._details, self._plant.f1
        share = self._x2 / details.stribeck
        level = f1 * (1.0 + details.stribeck_ratio * exponential(-(share * share)))
        if not details.bristle or not f1:
            return math.copysign(max(0.0, abs(free) - h * level), free)
        stiffness = f1 / details.bristle
        damping = math.sqrt(stiffness)
        # z' with z at the end of the step, and F of it; both are linear in z.
        rate = stiffness * abs(self._x2) / level
        z = (self._deflection + h * self._x2) / (1.0 + h * rate)
        friction = stiffness * z + damping * (self._x2 - rate * z)
        self._deflection = z
        return free - h * friction
