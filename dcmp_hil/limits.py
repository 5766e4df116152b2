"""Limits on reference, voltage and slew: the one that acts is named, and none may act for long."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.errors import TripError
from dcmp_hil.values import Event, Reference

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.values import Sample

_SAID_EVERY = 1.0  # s, each limit
_SATURATED = 0.5  # s in a row at a limit of the voltage that end the run
_ASTRAY = 0.5  # s in a row that the arm may be too far from the reference: a step takes less
_IN_A_ROW = 2.5  # periods between two at most


class _Lasting:
    """Whether something has gone on for long enough, told only of the periods in which it does."""

    def __init__(self, allowed: float, gap: float) -> None:
        self._allowed, self._gap = allowed, gap
        self._since, self._last = math.inf, -math.inf

    def too_long(self, t: float) -> bool:
        """Take a period in which it does."""
        if not t - self._last <= self._gap:
            self._since = t
        self._last = t
        return t - self._since >= self._allowed


class Limits:
    """What the line may ask for; a limit that acts for too long ends the run in an orderly way.

    Parameters
    ----------
    voltage
        V, either way; infinity for none, as for all of these.
    slew
        V/s.
    position, velocity
        rad and rad/s, either way, for the reference: short of where the supervisor would trip.
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
    clamped
        Periods in which the demand was more than the limits allowed.
    concern
        Why the run should end; None while it may go on.
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
        error: float = math.inf,
    ) -> None:
        self.voltage_limit, self._step = voltage, slew * period
        self._x, self._v, self._error = position, velocity, error
        self._notify = notify
        self.concern: TripError | None = None
        self._slews = slew < math.inf
        self._said: dict[str, float] = {}
        self._saturated = _Lasting(_SATURATED, _IN_A_ROW * period)
        self._astray = _Lasting(_ASTRAY, _IN_A_ROW * period)
        self.clamped = 0

    def reference(self, sample: Sample, reference: Reference) -> Reference:
        """Return the reference, or what of it is allowed; NaN stays, and trips as the demand."""
        x, v, _ = reference
        error, most = x - sample.position, self._error
        if -self._x <= x <= self._x and -self._v <= v <= self._v and -most <= error <= most:
            return reference
        return self._limited_reference(sample, reference)

    def voltage(self, t: float, demand: float, last: float) -> float:
        """Return the demand, V, or what of it is allowed after `last` V."""
        most = self.voltage_limit
        if -most <= demand <= most and not self._slews:
            return demand
        return self._limited_voltage(t, demand, last)

    def slewed(self, voltage: float, last: float) -> float:
        """Return the voltage, or the nearest that the slew allows after `last` V."""
        return max(last - self._step, min(last + self._step, voltage))

    def _limited_reference(self, sample: Sample, reference: Reference) -> Reference:
        x, v, a = reference
        if not abs(x - sample.position) <= self._error and self._astray.too_long(sample.t):
            self.concern = TripError(
                "tracking",
                f"The arm has been more than {self._error:g} rad off the reference for {_ASTRAY:g} s "
                f"(reference {x:.2f} rad, position {sample.position:.2f} rad, t = {sample.t:.3f} s).",
                "Look for an obstacle, and at the reference, the gains and supervisor.error_limit_rad.",
            )
        if not abs(v) <= self._v:
            self._say(sample.t, f"reference's velocity limited to {self._v:.4g} rad/s: it asks for {v:.4g}")
            v, a = math.copysign(self._v, v) if v == v else v, 0.0
        if not abs(x) <= self._x:
            self._say(sample.t, f"reference limited to {self._x:.4g} rad: it asks for {x:.4g}")
            return Reference(math.copysign(self._x, x) if x == x else x, 0.0, 0.0)
        return Reference(x, v, a)

    def _limited_voltage(self, t: float, demand: float, last: float) -> float:
        most = self.voltage_limit
        voltage = max(-most, min(most, demand))
        if voltage != demand:
            self._say(t, f"voltage limited: {demand:.1f} V asked for, {most:.1f} V allowed")
        slewed = self.slewed(voltage, last) if self._slews else voltage
        if slewed != voltage:
            self._say(t, f"slew limited: {voltage:.1f} V asked for after {last:.1f} V")
        if slewed != demand:
            self._note_clamp(t, demand)
        return slewed

    def _note_clamp(self, t: float, demand: float) -> None:
        self.clamped += 1
        if self._saturated.too_long(t):
            self.concern = TripError(
                "saturation",
                f"The controller has asked for more than it may have for {_SATURATED:g} s "
                f"({demand:.1f} V at t = {t:.3f} s, {self.voltage_limit:g} V allowed).",
                "Ask for less in [reference], look for an obstacle, or raise amplifier.voltage_limit_V or "
                "amplifier.slew_V_s if the amplifier has more.",
            )

    def _say(self, t: float, sentence: str) -> None:
        which = sentence.partition(" limited")[0]
        if not t - self._said.get(which, -math.inf) < _SAID_EVERY:
            self._said[which] = t
            self._notify(Event(t, "WARN", sentence))
