"""References made of pieces: hold, step, trapezoid."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from dcmp_hil.common.section import NotNegative, Positive
from dcmp_hil.control.references import Peaks, References, ReferenceSettings
from dcmp_hil.values import Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Vector = NDArray[np.float64]


class Hold(ReferenceSettings):
    """A reference at one constant position."""

    kind: Literal["hold"]
    position_rad: float = 0.0
    """Position, rad; 0 = hanging."""

    def at(self, t: float) -> Reference:  # noqa: ARG002 - the same at every instant
        """Return the reference `t` seconds after the start."""
        return Reference(self.position_rad, 0.0, 0.0)

    def at_each(self, t: Vector) -> References:
        """Return the references at many instants, s after the start."""
        rest = np.zeros(len(t))
        return References(np.full(len(t), self.position_rad), rest, rest)

    def peaks(self, length: float) -> Peaks:  # noqa: ARG002 - the same at every instant
        """Return what it asks for at most."""
        return Peaks(abs(self.position_rad), 0.0, 0.0)


class Step(ReferenceSettings):
    """From one position to another in no time; the derivatives stay 0."""

    kind: Literal["step"]
    before_rad: float = 0.0
    """Position before the step, rad."""
    after_rad: float = 0.5
    """Position from the step on, rad."""
    at_s: NotNegative = 5.0
    """Instant of the step, s after the start."""

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""
        return Reference(self.after_rad if t >= self.at_s else self.before_rad, 0.0, 0.0)

    def at_each(self, t: Vector) -> References:
        """Return the references at many instants, s after the start."""
        rest = np.zeros(len(t))
        return References(np.where(t >= self.at_s, self.after_rad, self.before_rad), rest, rest)

    def peaks(self, length: float) -> Peaks:  # noqa: ARG002 - before and after the step
        """Return what it asks for at most; the step itself is bounded by the governor."""
        return Peaks(max(abs(self.before_rad), abs(self.after_rad)), 0.0, 0.0)


class Trapezoid(ReferenceSettings):
    """To and fro between two positions, the velocity a trapezoid, with a rest at either end."""

    kind: Literal["trapezoid"]
    low_rad: float = 0.0
    """First position, rad."""
    high_rad: float = 1.0
    """Position of the turn, rad."""
    velocity_rad_s: Positive = 1.0
    """Velocity in the middle of a move, rad/s."""
    acceleration_rad_s2: Positive = 4.0
    """Acceleration at both ends of a move, rad/s2."""
    rest_s: NotNegative = 1.0
    """Rest at either end, s."""

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""
        distance = self.high_rad - self.low_rad
        ramp, move = self._times(distance)
        if ramp == 0.0:
            return Reference(self.low_rad, 0.0, 0.0)
        there, into = divmod(max(t, 0.0), move + self.rest_s)
        start, way = (self.low_rad, distance) if there % 2 == 0 else (self.high_rad, -distance)
        x, v, a = trapezoid(min(into / move, 1.0), ramp / move)
        return Reference(start + way * x, way * v / move, way * a / move**2)

    def at_each(self, t: Vector) -> References:
        """Return the references at many instants, s after the start."""
        distance = self.high_rad - self.low_rad
        ramp, move = self._times(distance)
        if ramp == 0.0:
            rest = np.zeros(len(t))
            return References(np.full(len(t), self.low_rad), rest, rest)
        there, into = np.divmod(np.maximum(t, 0.0), move + self.rest_s)
        goes = there % 2 == 0
        start, way = np.where(goes, self.low_rad, self.high_rad), np.where(goes, distance, -distance)
        x, v, a = trapezoids(np.minimum(into / move, 1.0), ramp / move)
        return References(start + way * x, way * v / move, way * a / move**2)

    def _times(self, distance: float) -> tuple[float, float]:
        """Return the lengths of a ramp and of a move, s, over a distance (rad); 0 and 0 for no distance."""
        # A move too short for the full velocity is a triangle.
        ramp = min(
            self.velocity_rad_s / self.acceleration_rad_s2,
            math.sqrt(abs(distance) / self.acceleration_rad_s2),
        )
        return (ramp, ramp + abs(distance) / (self.acceleration_rad_s2 * ramp)) if ramp else (0.0, 0.0)

    def peaks(self, length: float) -> Peaks:  # noqa: ARG002 - a move is judged as a whole
        """Return what it asks for at most."""
        low, high = self.low_rad, self.high_rad
        hardest = self.acceleration_rad_s2 if low != high else 0.0
        fastest = min(self.velocity_rad_s, math.sqrt(abs(high - low) * hardest))
        return Peaks(max(abs(low), abs(high)), fastest, hardest)


def trapezoid(s: float, ramp: float) -> tuple[float, float, float]:
    """Move from 0 to 1 while `s` goes from 0 to 1, the velocity a trapezoid.

    Parameters
    ----------
    s
        Part of the time gone; below 0 and above 1 the move rests.
    ramp
        Part of the time spent accelerating, and again decelerating; above 0, at most 0.5.

    Returns
    -------
    tuple
        Position and its first two derivatives by `s`.
    """
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if s >= 1.0:
        return 1.0, 0.0, 0.0
    top = 1.0 / (1.0 - ramp)
    steep = top / ramp
    if s < ramp:
        return 0.5 * steep * s * s, steep * s, steep
    if s > 1.0 - ramp:
        left = 1.0 - s
        return 1.0 - 0.5 * steep * left * left, steep * left, -steep
    return top * (s - 0.5 * ramp), top, 0.0


def trapezoids(s: Vector, ramp: float) -> tuple[Vector, Vector, Vector]:
    """Return `trapezoid` of many `s`, each of shape (n,)."""
    top = 1.0 / (1.0 - ramp)
    steep = top / ramp
    left = 1.0 - s
    cases = [s <= 0.0, s >= 1.0, s < ramp, s > 1.0 - ramp]
    x = np.select(
        cases, [0.0, 1.0, 0.5 * steep * s * s, 1.0 - 0.5 * steep * left * left], top * (s - 0.5 * ramp)
    )
    v = np.select(cases, [0.0, 0.0, steep * s, steep * left], top)
    return x, v, np.select(cases, [0.0, 0.0, steep, -steep], 0.0)
