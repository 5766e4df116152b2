"""The limiter of reference, voltage and slew: the one that acts is named, and none may act for long."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.common.rate_limit import RateLimit
from dcmp_hil.safety.reference_governor import Bounds, ReferenceGovernor
from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.values import Event, EventKind, LimitData, Reference

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.safety.chatter import Chatter
    from dcmp_hil.values import Sample

_EVENT_PERIOD_S = 1.0  # s, each limit
_SATURATION_TIME_MAX_S = 0.5  # s in a row at a limit of the voltage that end the run
_TRACKING_ERROR_TIME_MAX_S = 0.5
"""Seconds in a row that the arm may be too far from the reference: a step takes less."""
_SPEED_UP_TIME_MIN_S = 0.02  # s from rest to the largest velocity
CONSECUTIVE_GAP_PERIODS_MAX = 2.5
"""Periods between two cycles of one condition, at most."""

LIMITS = {
    "reference": "reference limited to {:.4g} rad: it asks for {:.4g}",
    "velocity": "reference's velocity limited to {:.4g} rad/s: it asks for {:.4g}",
    "acceleration": "reference's acceleration limited to {:.4g} rad/s2: it asks for {:.4g}",
    "way": "reference's way limited: the arm is led to {:.4g} rad as the limits allow",
    "voltage": "voltage limited: {:.1f} V asked for, {:.1f} V allowed",
    "slew": "slew limited: {:.1f} V asked for after {:.1f} V",
}
"""Sentences of the limits, by name."""


class _Lasting:
    """Whether something has gone on for long enough, told only of the periods in which it does."""

    def __init__(self, allowed: float, gap: float) -> None:
        self._allowed, self._gap = allowed, gap
        self._since, self._last = math.inf, -math.inf

    def too_long(self, t: float) -> bool:
        """Note that the condition holds at `t` (s); return whether it has held for too long."""
        if not t - self._last <= self._gap:
            self._since = t
        self._last = t
        return t - self._since >= self._allowed


class Limiter:
    """Limits of reference and voltage; a limit that acts for too long ends the run by a ramp.

    Parameters
    ----------
    voltage
        V, either way; infinity for none, as for all of these.
    slew
        V/s.
    position, velocity, acceleration
        rad, rad/s and rad/s2, either way, for the reference: short of where the supervisor would trip, and
        of what the motor can follow.
    braking
        rad/s2, that a stop of the reference may reckon with.
    strongest
        rad/s2, of the motor at full voltage: which jumps of the reference may be left to the controller.
    error
        rad, by which the measured position may be off the reference for half a second.
    period
        s, nominal.
    notify
        Told which limit acts, at most once a second each.

    Attributes
    ----------
    voltage_limit
        V, either way.
    bounds
        Of the reference.
    clamped
        Periods in which the demand was more than the limits allowed.
    chatter
        Judges the variation of the voltage; None where nothing does.
    objection
        Why the run should end: a limit that has acted for too long, or chatter; None while it may go on.
    """

    def __init__(
        self,
        *,
        voltage: float,
        period: float,
        notify: Callable[[Event], None],
        slew: float = math.inf,
        position: float = math.inf,
        velocity: float = math.inf,
        acceleration: float = math.inf,
        braking: float = math.inf,
        strongest: float = math.inf,
        error: float = math.inf,
    ) -> None:
        self.voltage_limit, self._step = voltage, slew * period
        self._x, self._v, self._error = position, velocity, error
        self._a = min(acceleration, velocity / _SPEED_UP_TIME_MIN_S)
        self.bounds = Bounds(position, velocity, self._a, min(braking, self._a), strongest)
        self._governor = ReferenceGovernor(self.bounds) if math.isfinite(position + velocity) else None
        self._notify = notify
        self.objection: TripRequest | None = None
        self._slews = slew < math.inf
        self._rate_limit = RateLimit(_EVENT_PERIOD_S)
        self._saturated = _Lasting(_SATURATION_TIME_MAX_S, CONSECUTIVE_GAP_PERIODS_MAX * period)
        self._astray = _Lasting(_TRACKING_ERROR_TIME_MAX_S, CONSECUTIVE_GAP_PERIODS_MAX * period)
        self.clamped = 0
        self.chatter: Chatter | None = None
        self._change = 0.0  # V, sum of |dV| in this block
        self._left = -1  # periods to its end, if it has one

    def watch_variation(self, chatter: Chatter) -> None:
        """Begin to judge the variation of the voltage."""
        self.chatter, self._left = chatter, chatter.block

    def limit_reference(self, sample: Sample, reference: Reference) -> Reference:
        """Return the reference, or what of it is allowed; NaN stays, and trips as the demand."""
        t, position, _, _ = sample
        governed = self._governor.bound(t, reference) if self._governor else reference
        x, _, _ = reference
        if governed is reference and abs(x - position) <= self._error:
            return reference
        return self._judged(sample, reference, governed)

    def limit_voltage(self, t: float, demand: float, last: float) -> float:
        """Return the demand, V, or what of it is allowed after `last` V."""
        if not abs(demand) <= self.voltage_limit or self._slews:
            demand = self._limited_voltage(t, demand, last)
        self._change += demand - last if demand > last else last - demand
        self._left -= 1
        if not self._left:
            self._judge_variation(t)
        return demand

    def limit_slew(self, voltage: float, last: float) -> float:
        """Return the voltage, or the nearest that the slew allows after `last` V."""
        return max(last - self._step, min(last + self._step, voltage))

    def _judge_variation(self, t: float) -> None:
        assert self.chatter is not None  # noqa: S101 - without one, no block ends
        self.objection = self.objection or self.chatter.judge(t, self._change)
        self._change, self._left = 0.0, self.chatter.block

    def _judged(self, sample: Sample, asked: Reference, reference: Reference) -> Reference:
        """Report a limited reference; stop if the arm is too far from the governed one."""
        x = reference.position
        if not abs(x - sample.position) <= self._error and self._astray.too_long(sample.t):
            self.objection = astray(sample.t, x, sample.position, self._error)
        if reference is not asked:
            self._say_governed(sample.t, asked)
        return reference

    def _say_governed(self, t: float, reference: Reference) -> None:
        x, v, a = reference
        if not abs(x) <= self._x:
            self._say(t, "reference", self._x, x)
        elif not abs(v) <= self._v:
            self._say(t, "velocity", self._v, v)
        elif not abs(a) <= self._a:
            self._say(t, "acceleration", self._a, a)
        else:
            self._say(t, "way", x)

    def _limited_voltage(self, t: float, demand: float, last: float) -> float:
        most = self.voltage_limit
        voltage = max(-most, min(most, demand))
        if voltage != demand:
            self._say(t, "voltage", demand, most)
        slewed = self.limit_slew(voltage, last) if self._slews else voltage
        if slewed != voltage:
            self._say(t, "slew", voltage, last)
        if slewed != demand:
            self._note_clamp(t, demand)
        return slewed

    def _note_clamp(self, t: float, demand: float) -> None:
        self.clamped += 1
        if self._saturated.too_long(t):
            self.objection = saturated(t, demand, self.voltage_limit)

    def _say(self, t: float, limit: str, *values: float) -> None:
        if self._rate_limit.passes(limit, t):
            self._notify(limit_event(t, limit, *values))


def limit_event(t: float, limit: str, *values: float) -> Event:
    """Return the event that a limit acts at `t` (s, device time).

    Parameters
    ----------
    t
        s.
    limit
        One of `LIMITS`.
    values
        The numbers of its sentence; further ones are left out.
    """
    return Event(t, "WARN", EventKind.LIMIT, LIMITS[limit].format(*values), LimitData(limit))


def astray(t: float, reference: float, position: float, error: float) -> TripRequest:
    """Return the request to trip for an arm that was off its reference for too long.

    Parameters
    ----------
    t
        s, device time.
    reference, position
        rad.
    error
        rad, by which they may differ.
    """
    return TripRequest(
        "tracking",
        f"The arm has been more than {error:g} rad off the reference for {_TRACKING_ERROR_TIME_MAX_S:g} s "
        f"(reference {reference:.2f} rad, position {position:.2f} rad, t = {t:.3f} s).",
        "Look for an obstacle, and at the reference, the gains and supervisor.error_limit_rad.",
        Urgency.RAMP,
    )


def saturated(t: float, demand: float, limit: float) -> TripRequest:
    """Return the request to trip for demands (V) beyond the limit (V) for too long, at `t` (s)."""
    return TripRequest(
        "saturation",
        f"The controller has asked for more than it may have for {_SATURATION_TIME_MAX_S:g} s "
        f"({demand:.1f} V at t = {t:.3f} s, {limit:g} V allowed).",
        "Ask for less in [reference], look for an obstacle, or raise amplifier.voltage_limit_V or "
        "amplifier.slew_V_s if the amplifier has more.",
        Urgency.RAMP,
    )
