"""Controllers that chatter: what a sliding-mode controller without a boundary layer, and a bad gain, do."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil import ControllerContext, Estimate, Reference


class Bang:
    """Switches between two voltages, for any position of the arm."""

    def __init__(self, context: ControllerContext, volts: float = 10.0, every: int = 1) -> None:  # noqa: ARG002
        self._volts, self._every = volts, every
        self._periods = 0

    def update(self, reference: Reference, estimate: Estimate) -> float:  # noqa: ARG002
        """Return the two voltages in turn, V."""
        self._periods += 1
        return self._volts if self._periods // self._every % 2 else -self._volts


class Sign:
    """A sliding-mode controller with all the voltage and no boundary layer."""

    def __init__(self, context: ControllerContext, slope: float = 30.0, volts: float = 10.0) -> None:  # noqa: ARG002
        self._slope, self._volts = slope, volts

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return all the voltage, towards the sliding surface."""
        error = reference.position - estimate.position
        surface = reference.velocity - estimate.velocity + self._slope * error
        return math.copysign(self._volts, surface)


class InBursts:
    """Chatters for most of the time, and is quiet in between."""

    def __init__(self, context: ControllerContext, on: int = 180, off: int = 60) -> None:  # noqa: ARG002
        self._on, self._off = on, off
        self._periods = 0

    def update(self, reference: Reference, estimate: Estimate) -> float:  # noqa: ARG002
        """Return 10 V by turns, or nothing."""
        self._periods += 1
        if self._periods % (self._on + self._off) >= self._on:
            return 0.0
        return 10.0 if self._periods % 2 else -10.0


class Growing:
    """A proportional gain that grows without end: healthy at first."""

    def __init__(self, context: ControllerContext) -> None:
        self._ku, self._gain = context.model.ku, 100.0

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return what a gain asks for that is larger every period."""
        self._gain *= 1.003
        error = reference.position - estimate.position
        return (self._gain * error - 0.5 * self._gain * estimate.velocity) / self._ku
