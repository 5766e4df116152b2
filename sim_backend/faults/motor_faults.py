"""Faults of motor and power stage, and torques of people."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import deque

from sim_backend.faults.plant_fault import PlantFault


class Gain(PlantFault):
    """The motor sees `factor` times the voltage: 0 without power, -1 with its wires swapped."""

    def voltage(self, volts: float) -> float:
        """Return the voltage times `factor`, V."""
        return volts * self.number("factor")


class Power(PlantFault):
    """The motor has no power."""

    def voltage(self, volts: float) -> float:  # noqa: ARG002
        """Return 0 V."""
        return 0.0


class MotorSign(PlantFault):
    """The motor's wires are swapped."""

    def voltage(self, volts: float) -> float:
        """Return the negated voltage, V."""
        return -volts


class Saturation(PlantFault):
    """The power stage gives no more than `V`, and the reported voltage does not show it."""

    def voltage(self, volts: float) -> float:
        """Return the voltage, limited to `V`."""
        most = self.number("V")
        return max(-most, min(most, volts))


class Offset(PlantFault):
    """The power stage adds a voltage, while it is switched on or not."""

    def voltage(self, volts: float) -> float:
        """Return the voltage plus `V`."""
        return volts + self.number("V")


class DeadBand(PlantFault):
    """The power stage gives nothing below `V`."""

    def voltage(self, volts: float) -> float:
        """Return the voltage, 0 V below `V`."""
        return 0.0 if abs(volts) < self.number("V") else volts


class Shove(PlantFault):
    """The arm is pushed, one way or the other."""

    _volts = 0.0

    def begin(self) -> None:
        """Choose a way."""
        sign = {"up": 1, "down": -1}.get(self.word("way")) or self.rng.choice((-1, 1))
        self._volts = sign * self.number("rad_s2") / self.facts.ku

    def voltage(self, volts: float) -> float:
        """Return the voltage plus the equivalent of the push, V."""
        return volts + self._volts


class Torque(PlantFault):
    """A torque acts on the arm; its course in time is the derived class's."""

    _age = -1

    def begin(self) -> None:
        """Begin its time."""
        self._age = -1

    def voltage(self, volts: float) -> float:
        """Return the voltage plus the equivalent of the torque, V."""
        self._age += 1
        return volts + self.course(self._age * self.facts.period) * self.number("rad_s2") / self.facts.ku

    @abstractmethod
    def course(self, t: float) -> float:
        """Return the torque `t` s after its begin, relative to its amplitude."""


class Push(Torque):
    """A hand pushes the arm once: half a sine."""

    def course(self, t: float) -> float:
        """Return half a sine of `ms`."""
        length = 1e-3 * self.number("ms")
        return math.sin(math.pi * t / length) if t < length else 0.0


class Sway(Torque):
    """A hand moves the arm to and fro."""

    def course(self, t: float) -> float:
        """Return a sine of `hz`."""
        return math.sin(math.tau * self.number("hz") * t)


class Square(Torque):
    """A torque that changes its sign."""

    def course(self, t: float) -> float:
        """Return the sign of a sine of `hz`."""
        return math.copysign(1.0, math.sin(math.tau * self.number("hz") * t))


class UnknownDelay(PlantFault):
    """The motor sees a voltage some periods after the reported instant."""

    def begin(self) -> None:
        """Begin with 0 V under way."""
        self._under_way = deque([0.0] * round(self.number("periods")))

    def voltage(self, volts: float) -> float:
        """Return the voltage of `periods` periods ago, V."""
        self._under_way.append(volts)
        return self._under_way.popleft()
