"""The reference governor: a reference passes unchanged while the arm can follow it inside its limits.

Where it cannot, the arm is led by a motion of its own: at most so fast, with at most so much acceleration,
and so that it can always stop short of the farthest position. Where both meet, the reference takes over.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from dcmp_hil.control.elementary import exponential
from dcmp_hil.values import Reference

_BRAKING_ACCELERATION_SHARE = 0.7
"""Of the acceleration, that a stop reckons with: what it takes to begin one is the rest."""
_MOVING_ACCELERATION_SHARE = 0.8  # of the acceleration, between stops
_APPROACH_ACCELERATION_SHARE = 0.5  # of the acceleration, that the way to a position is laid out for
_PULL_1_S, _DAMPING_1_S = 5.0, 15.0  # 1/s, of a small distance; of the velocity
_ACCELERATION_LAG_S = 0.02  # s, over which its own acceleration changes: the voltage has no steps from it
_JOIN_TOLERANCES = Reference(5e-4, 0.02, 2.0)  # rad, rad/s, rad/s2: so close it goes over into the reference
JUMP_MAX_RAD = 2.0
"""Largest jump that is not governed, rad."""
OVERSHOOT_SHARE = 0.4
"""Of a jump, by which the arm may go beyond it."""
_MOTOR_GAIN_RATIO_MAX = 1.5  # times the believed motor gain
_JUMP_INTERVAL_MIN_S = 0.5  # s
_GAP_MAX_S, _INTEGRATION_STEP_S = 0.1, 2e-3  # s


class Bounds(NamedTuple):
    """Largest position, velocity and acceleration of a reference, both signs."""

    position: float  # rad
    velocity: float  # rad/s
    acceleration: float  # rad/s2
    braking: float  # rad/s2, of a stop, and of its own motion
    strongest: float = math.inf  # rad/s2, of the motor at full voltage

    @property
    def stop(self) -> float:
        """Way that a stop takes over the square of the velocity, s2/rad."""
        return 0.5 / (_BRAKING_ACCELERATION_SHARE * self.braking)

    def jump(self, target: float, distance: float) -> bool:
        """Return whether a jump to `target` (rad) over `distance` may be left to the controller."""
        size = abs(distance)
        return self.short(size) and abs(target) + OVERSHOOT_SHARE * size <= self.position

    def short(self, size: float) -> bool:
        """Return whether a jump of this size (rad) is no longer and no faster than one may be."""
        known = math.isfinite(self.strongest)  # else it is a simulation without a limit
        fastest = math.sqrt(_MOTOR_GAIN_RATIO_MAX * self.strongest * size) if known else 0.0
        return size <= JUMP_MAX_RAD and fastest <= self.velocity


class ReferenceGovernor:
    """Keeps a reference inside bounds.

    Parameters
    ----------
    bounds
        Infinite ones let everything pass.

    Attributes
    ----------
    leads
        Whether the last reference returned was its own.
    last
        The last reference returned.
    """

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self._x, self._v, self._a, self._own, _ = bounds
        self._stop = bounds.stop
        self._t = self._jumped = -math.inf
        self.last = Reference(math.nan, 0.0, 0.0)
        self.leads = False

    def bound(self, t: float, reference: Reference) -> Reference:
        """Return the reference for device time `t` (s), or what of it is possible; NaN stays."""
        dt, self._t = t - self._t, t
        x, v, a = reference
        if self.leads:
            return self._led(dt, reference)
        if not (
            abs(v) <= self._v
            and abs(a) <= self._a
            and abs(x + self._stop * v * abs(v)) <= self._x
            and abs(x) <= self._x
        ):
            return self._begin(dt, reference)
        if not abs(x - self.last.position) <= self._v * dt and not self._may_jump(t, x):
            return self._begin(dt, reference)
        self.last = reference
        return reference

    def _may_jump(self, t: float, target: float) -> bool:
        """Return whether a reference that jumps may be left to the controller, now and then."""
        distance = target - self.last.position
        if distance != distance:  # the first
            return True
        allowed = self._bounds.jump(target, distance) and t - self._jumped >= _JUMP_INTERVAL_MIN_S
        self._jumped = t if allowed else self._jumped
        return allowed

    def _begin(self, dt: float, reference: Reference) -> Reference:
        x, v, a = reference
        if not math.isfinite(x + v + a):
            return reference
        if self.last.position != self.last.position:  # no arm has been led yet
            self.last = Reference(min(max(x, -self._x), self._x), 0.0, 0.0)
        self.leads = True
        return self._led(dt, reference)

    def _led(self, dt: float, reference: Reference) -> Reference:
        """Move on in steps of a few milliseconds, however long the period was."""
        dt = min(dt, _GAP_MAX_S)
        x, v, a = reference
        if not math.isfinite(x + v + a):
            return reference
        if self._met(reference):
            self.leads = False
            self.last = reference
            return reference
        steps = max(1, math.ceil(dt / _INTEGRATION_STEP_S))
        dt /= steps
        smooth = exponential(-dt / _ACCELERATION_LAG_S)
        for _ in range(steps):
            self.last = self._lead(dt, smooth, reference)
        return self.last

    def _lead(self, dt: float, smooth: float, reference: Reference) -> Reference:
        """Move on by `dt`, towards the reference where it is inside, towards the bound where it is not."""
        x, v, a = self.last
        target, speed, push = reference
        if not (abs(target) <= self._x and abs(speed) <= self._v and abs(push) <= self._a):
            target, speed, push = min(max(target, -self._x), self._x), 0.0, 0.0
        wanted = self._wanted(x, v, target, speed, push)
        a = wanted + smooth * (a - wanted)
        x, v = x + dt * (v + 0.5 * dt * a), v + dt * a
        if abs(v) > self._v:
            v, a = math.copysign(self._v, v), 0.0
        if abs(x) > self._x:
            x, v, a = math.copysign(self._x, x), 0.0, 0.0
        return Reference(x, v, a)

    def _wanted(self, x: float, v: float, target: float, speed: float, push: float) -> float:
        """Return the acceleration to aim at, rad/s2."""
        if not -self._x < x + self._stop * v * abs(v) < self._x and x * v >= 0.0 and v != 0.0:
            return math.copysign(self._own, -v)
        easy, most = _APPROACH_ACCELERATION_SHARE * self._own, _MOVING_ACCELERATION_SHARE * self._own
        left = target - x
        near = easy / _PULL_1_S**2
        way = _PULL_1_S * left
        if abs(left) > near:
            way = math.copysign(math.sqrt(2.0 * easy * (abs(left) - 0.5 * near)), left)
        way = min(
            max(way + speed, -_MOVING_ACCELERATION_SHARE * self._v), _MOVING_ACCELERATION_SHARE * self._v
        )
        return min(max(push + _DAMPING_1_S * (way - v), -most), most)

    def _met(self, reference: Reference) -> bool:
        x, v, a = reference
        near = all(
            abs(is_ - own) <= met
            for is_, own, met in zip(reference, self.last, _JOIN_TOLERANCES, strict=True)
        )
        inside = abs(x) <= self._x and abs(v) <= self._v and abs(a) <= self._a
        return near and inside and abs(x + self._stop * v * abs(v)) <= self._x
