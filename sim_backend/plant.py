"""The pendulum's physics, eqs. (1)-(4): a set-valued friction that can stick, or the paper's naive Euler."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.control.elementary import sine
from dcmp_hil.values import Truth
from sim_backend.core_plant import CorePlant
from sim_backend.detailed_plant import DetailedPlant
from sim_backend.engine import engine_of

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.control.model import Model
    from sim_backend.engine import Engine


class Plant(Protocol):
    """Protocol of a simulated plant."""

    def advance(self, voltage: float) -> Truth:
        """Hold `voltage` (V) for one period and return the state at its end."""
        ...

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        ...


class MoreauPlant:
    """Coulomb friction as a set, time-stepped after Moreau (Acary and Brogliato 2008).

    Each step first finds the velocity without friction, then lets friction take away what it can: the arm
    really sticks, and w is defined at a reversal. The external disturbance is held over a period.

    Parameters
    ----------
    plant
        What the simulation is.
    model
        What the host believes: the true w of eq. (3) is defined by the believed f0 and ku/J.
    position
        rad, at rest, at the start.
    step
        s.
    steps
        Steps in a period.
    """

    def __init__(self, plant: Model, model: Model, *, position: float, step: float, steps: int) -> None:
        self._plant = plant
        self._f0, self._ku = model.f0, model.ku
        self._step, self._steps = step, range(steps)
        self._periods = 0
        self._x1, self._x2 = position, 0.0

    def advance(self, voltage: float) -> Truth:
        """Hold `voltage` (V) for one period and return the state at its end."""
        f0, f1, gravity, ku, *_ = self._plant
        h = self._step
        x1, x2 = self._x1, self._x2
        held = self._plant.external(self._periods * len(self._steps) * h) + ku * voltage
        most = h * f1
        before = x2
        for _ in self._steps:
            before = x2
            x2 += h * (held - f0 * x2 - gravity * sine(x1))
            x2 = x2 - most if x2 > most else x2 + most if x2 < -most else 0.0
            x1 += h * x2
        self._x1, self._x2 = x1, x2
        self._periods += 1
        w = (x2 - before) / h + self._f0 * before - self._ku * voltage
        return make(Truth, (x1, x2, w))  # 0.08 us less

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        self._step *= factor


class EulerPlant:
    """The paper's own simulation: explicit Euler, friction by a sign that chatters at rest.

    Parameters
    ----------
    plant, model, position, step, steps
        As for MoreauPlant.
    """

    def __init__(self, plant: Model, model: Model, *, position: float, step: float, steps: int) -> None:
        self._plant = plant
        self._f0, self._ku = model.f0, model.ku
        self._step, self._steps = step, steps
        self._done = 0
        self._x1, self._x2 = position, 0.0

    def advance(self, voltage: float) -> Truth:
        """Hold `voltage` (V) for one period and return the state at its end."""
        f0, _, _, ku, *_ = self._plant
        h = self._step
        x1, x2, w = self._x1, self._x2, 0.0
        for _ in range(self._steps):
            w = self._disturbance(x1, x2, self._done * h)
            slope = -f0 * x2 + w + ku * voltage
            x1, x2 = x1 + h * x2, x2 + h * slope
            self._done += 1
        self._x1, self._x2 = x1, x2
        now = self._disturbance(x1, x2, self._done * h)
        return Truth(x1, x2, now + (self._f0 - f0) * x2 + (ku - self._ku) * voltage)

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        self._step *= factor

    def _disturbance(self, x1: float, x2: float, t: float) -> float:
        """Return w of eq. (2), rad/s2."""
        sign = math.copysign(1.0, x2) if x2 != 0.0 else 0.0
        return -self._plant.f1 * sign + self._plant.external(t) - self._plant.gravity * sine(x1)


def make_plant(rig: Rig, engine: Engine | None = None) -> Plant:
    """Make the plant that a rig's `[sim]` and `[model]` describe; None finds its engine."""
    module, _, name = rig.sim.plant_class.partition(":")
    steps = rig.plant_steps
    place = {"position": rig.sim.position_rad, "step": rig.period / steps}
    if (engine or engine_of(rig)).core:
        return CorePlant(rig.plant, rig.model.values(), **place, steps=steps)
    details = rig.sim.details
    if details is not None:
        return DetailedPlant(rig.plant, rig.model.values(), details, **place, steps=steps)
    plant: Plant = getattr(import_module(module), name)(rig.plant, rig.model.values(), **place, steps=steps)
    return plant
