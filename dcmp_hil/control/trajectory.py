"""The trajectory of one run: hold, soft start into the reference, changes of it, and the way down."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dcmp_hil.values import Reference

if TYPE_CHECKING:
    from dcmp_hil.control.references import ReferenceSource

LOWERING_TIME_S = 2.0  # s, from any position of the arm to hanging
_TRANSITION_TIME_MIN_S = 1.0  # s, from one reference into another, at least
_TRANSITION_VELOCITY_MAX_RAD_S = 2.0  # that a change of position adds at most
_TRANSITION_ACCELERATION_MAX_RAD_S2 = 10.0  # the same, of the acceleration


class Trajectory:
    """A reference with a beginning and an end.

    Parameters
    ----------
    source
        The reference, a function of the time since `begin`.
    soft_start
        s, over which the reference fades in from the arm's own position; 0 = at once.
    """

    def __init__(self, source: ReferenceSource, soft_start: float) -> None:
        self._source = source
        self._soft_start = soft_start
        self._t0 = 0.0
        self._x0 = 0.0
        self._begun = False
        self._plain_from = math.inf  # s, device time from which the reference is all there is
        self._way_down: _Quintic | None = None
        self._bridge: _Quintic | None = None  # what is left of the reference before the last change

    @property
    def lowering(self) -> bool:
        """Whether the way down has been laid."""
        return self._way_down is not None

    @property
    def began(self) -> float:
        """Device time at which the trajectory began, s; infinity before it did."""
        return self._t0 if self._begun else math.inf

    def hold(self, position: float) -> None:
        """Stay at `position` (rad) until the trajectory begins."""
        self._x0 = position

    def begin(self, t: float, position: float) -> None:
        """Start the trajectory's clock at device time `t`, from `position` (rad)."""
        self._t0, self._x0, self._begun = t, position, True
        if self._way_down is None:
            self._plain_from = t + self._soft_start

    def lower(self, t: float) -> None:
        """From `t` on, go down to position 0, hanging, in `LOWERING_TIME_S` seconds; nothing jumps."""
        self._way_down = _Quintic(t, LOWERING_TIME_S, self.at(t))
        self._plain_from = math.inf

    def change(self, t: float, source: ReferenceSource) -> None:
        """Change to another reference from device time `t` on (s), continuous up to the acceleration.

        The difference of the two at `t` is what a quintic takes to 0: in a second, or as much longer as
        2 rad/s and 10 rad/s2 ask for. However often that is done, one quintic is left to work out.
        """
        before = self.at(t)
        self._source, self._bridge = source, None
        if self._begun:
            plain_from, self._plain_from = self._plain_from, math.inf
            gap = Reference(*(old - new for old, new in zip(before, self.at(t), strict=True)))
            self._bridge = _Quintic(t, _time_to_bridge(gap), gap)
            self._plain_from = max(plain_from, t + self._bridge.length)

    def at(self, t: float) -> Reference:
        """Return the reference at device time `t`."""
        if self._plain_from <= t < math.inf:
            return self._source.at(t - self._t0)
        if self._way_down is not None and t >= self._way_down.t0:
            return self._way_down.at(t)
        bridge = self._bridge
        if bridge is None:
            return self._unbridged(t)
        x, v, a = self._unbridged(t)
        left = bridge.at(t)
        return Reference(x + left.position, v + left.velocity, a + left.acceleration)

    def velocity(self, t: float) -> float:
        """Return the velocity of the reference at device time `t`, rad/s."""
        return self.at(t).velocity

    def _unbridged(self, t: float) -> Reference:
        if not t < math.inf:  # NaN in, NaN out: the supervisor finds it in the demand
            return Reference(math.nan, math.nan, math.nan)
        if not self._begun or t < self._t0:
            return Reference(self._x0, 0.0, 0.0)
        since = t - self._t0
        reference = self._source.at(since)
        if since < self._soft_start:
            return _faded_in(reference, self._x0, fade(since, self._soft_start))
        return reference


def fade(since: float, length: float) -> tuple[float, float, float]:
    """Return the weight of the reference in a soft start, with its exact derivatives (1/s, 1/s2).

    It is b = 10 s^3 - 15 s^4 + 6 s^5 with s = since / length.

    Parameters
    ----------
    since
        s, from the beginning of the trajectory on.
    length
        s, of the soft start.
    """
    s = max(since / length, 0.0)
    left = 1.0 - s
    gone = s * s * s * (10.0 + s * (6.0 * s - 15.0))
    gone1 = 30.0 * s * s * (left * left) / length
    gone2 = 60.0 * s * left * (1.0 - 2.0 * s) / (length * length)
    return gone, gone1, gone2


def _faded_in(reference: Reference, x0: float, weights: tuple[float, float, float]) -> Reference:
    """(1 - b) x0 + b x_r, and its exact derivatives."""
    gone, gone1, gone2 = weights
    x, v, a = reference
    return Reference(
        x0 + gone * (x - x0), gone * v + gone1 * (x - x0), gone * a + 2.0 * gone1 * v + gone2 * (x - x0)
    )


def _time_to_bridge(gap: Reference) -> float:
    """Return the length of a quintic over a gap: its peaks are 1.875 d / T and 5.774 d / T^2."""
    distance = abs(gap.position)
    return max(
        _TRANSITION_TIME_MIN_S,
        1.875 * distance / _TRANSITION_VELOCITY_MAX_RAD_S,
        math.sqrt(5.774 * distance / _TRANSITION_ACCELERATION_MAX_RAD_S2),
    )


@dataclass(frozen=True, slots=True)
class _Quintic:
    """The quintic that takes over position, velocity and acceleration at `t0` and ends in rest at 0."""

    t0: float
    length: float
    start: Reference

    def at(self, t: float) -> Reference:
        length = self.length
        s = min(max((t - self.t0) / length, 0.0), 1.0)
        x, v, a = self.start.position, length * self.start.velocity, 0.5 * length**2 * self.start.acceleration
        # x0 left^3 (1 + 3 s + 6 s^2) + v0 left^3 (s + 3 s^2) + a0 left^3 s^2 / 2 with left = 1 - s
        left = 1.0 - s
        p0, p1, p2 = x, 3.0 * x + v, 6.0 * x + 3.0 * v + a
        p = p0 + s * (p1 + s * p2)
        dp, ddp = p1 + 2.0 * s * p2, 2.0 * p2
        return Reference(
            left**3 * p,
            left**2 * (left * dp - 3.0 * p) / length,
            left * (left * left * ddp - 6.0 * left * dp + 6.0 * p) / length**2,
        )
