"""Monitors: what may not happen while the amplifier is live, written so that NaN fails closed."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from dcmp_hil.errors import Explanation
from dcmp_hil.safety.device_faults import meaning_of
from dcmp_hil.safety.diagnosis import Diagnosis
from dcmp_hil.trip_request import TripRequest
from dcmp_hil.values import Fault

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from dcmp_hil.control.observers import Observer, ObserverContext
    from dcmp_hil.safety.diagnosis import Finding
    from dcmp_hil.values import Estimate, Sample

RUN_OBSERVER, WATCHING_OBSERVER = "the run's observer", "the supervisor's own observer"
"""Whose estimate a velocity is, in sentences."""
_HEALTHY = Fault.NONE  # found here faster than in its class
_MINUS_INF, _INF = -math.inf, math.inf
_FILTER_TIME_S, _ABOVE_TIME_S = 10e-3, 5e-3  # s, of the watching observer's disturbance


class FiniteMonitor:
    """Every number of sample and estimate is finite, and the device is healthy: needed on every rig."""

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:
        """Object to NaN, infinity and a device fault."""
        t, position, voltage, fault = sample
        if fault != _HEALTHY:
            sentence, remedy = meaning_of(fault)
            return TripRequest("device_fault", f"{sentence} (fault {fault}, t = {t:.3f} s).", remedy)
        x1, x2, w = estimate
        if not _MINUS_INF < t + position + voltage + x1 + x2 + w < _INF:  # a sum with a NaN is one
            return not_finite(sample, estimate)
        return None


class RangeMonitor:
    """Position and velocity stay inside their limits.

    Parameters
    ----------
    position
        rad, either way from hanging: the encoder's own.
    velocity
        rad/s, either way: the estimate's.
    spare
        rad/s, what an estimate may show more than the limit: less than that is the encoder's own step.
    seen_by
        Whose estimate it is, for the sentence.

    Attributes
    ----------
    velocity_max
        rad/s, either way: what an estimate may show.
    """

    def __init__(
        self, position: float, velocity: float, spare: float = 0.0, seen_by: str = RUN_OBSERVER
    ) -> None:
        self._position = position
        self._velocity, self.velocity_max, self._seen_by = velocity, velocity + spare, seen_by

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:
        """Object outside the limits."""
        t, position, _, _ = sample
        _, velocity, _ = estimate
        if not abs(velocity) <= self.velocity_max:
            return too_fast(t, velocity, self._velocity, self._seen_by)
        if not abs(position) <= self._position:
            return too_far(t, position, self._position)
        return None


class DisturbanceWatch:
    """A second, faster observer: what it cannot explain by voltage and inertia must stay plausible.

    Diverging observers, reversed polarity, a stuck encoder and lost motor power all show as an absurd w_hat:
    first-order filtered over 10 ms it reaches 20 rad/s2 in the worst healthy run, 45 with 1.5 times the
    motor gain and no soft start. Its velocity is what the limits are judged by: a limit that believed the
    observer of the run would be none where that observer is wrong.

    Parameters
    ----------
    observer
        The second observer (mu0 = 100 rad/s by default).
    setting
        What the host believes of the pendulum, and its encoder.
    limit
        rad/s2.
    for_
        s, how long the filtered |w_hat| must stay above the limit.
    ranges
        Asked where the second observer's velocity is beyond its `velocity_max`; None for no limit. The
        position is checked by a `RangeMonitor` of its own.
    """

    def __init__(
        self,
        observer: Observer,
        setting: ObserverContext,
        limit: float,
        for_: float = _ABOVE_TIME_S,
        ranges: RangeMonitor | None = None,
    ) -> None:
        self._ranges = ranges
        self._velocity_max = ranges.velocity_max if ranges else math.inf
        self._diagnosis = Diagnosis(setting)
        self._remember, self._update = self._diagnosis.add, observer.update
        self._keep = filter_keep(setting.period)
        self._limit = limit
        self._allowed = cycles_above(setting.period, for_)
        self._filtered = 0.0
        self._above = 0

    @property
    def samples(self) -> Collection[Sample]:
        """The last 100 ms."""
        return self._diagnosis.samples

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:  # noqa: ARG002 - it has its own
        """Object outside the limits, or if the disturbance was too large for too long.

        The stop for a disturbance can find the likely cause.
        """
        self._remember(sample)
        _, velocity, w = seen = self._update(sample)
        if not abs(velocity) <= self._velocity_max and self._ranges is not None:
            return self._ranges.check(sample, seen)
        self._filtered = filtered = w + self._keep * (self._filtered - w)
        if abs(filtered) <= self._limit:
            self._above = 0
            return None
        self._above += 1
        if self._above < self._allowed and filtered == filtered:
            return None
        return unknown_forces(sample.t, filtered, self._limit, self._diagnosis.finding)


def not_finite(sample: Sample, estimate: Estimate) -> TripRequest:
    """Return the request to trip for numbers that are not all finite."""
    t, position, voltage, _ = sample
    x1, x2, w = estimate
    return TripRequest(
        "not_finite",
        f"Not every number is finite at t = {t:.3f} s: position {position}, voltage {voltage}, "
        f"estimate ({x1}, {x2}, {w}).",
        "Look for a gain that makes the observer diverge, and at the encoder.",
    )


def too_fast(t: float, velocity: float, limit: float, seen_by: str = RUN_OBSERVER) -> TripRequest:
    """Return the request to trip for an estimated velocity (rad/s) beyond its limit at `t` (s)."""
    return TripRequest(
        "speed",
        f"Estimated velocity {velocity:.2f} rad/s at t = {t:.3f} s, by {seen_by}; the limit is {limit:g} "
        "rad/s.",
        "Check motor and encoder polarity, the gains, and supervisor.velocity_limit_rad_s.",
    )


def too_far(t: float, position: float, limit: float) -> TripRequest:
    """Return the request to trip for a position (rad) beyond its limit at `t` (s)."""
    return TripRequest(
        "travel",
        f"Position {position:.2f} rad at t = {t:.3f} s; the limit is {limit:g} rad.",
        "Check the reference, the encoder's zero, and supervisor.position_limit_rad.",
    )


def unknown_forces(t: float, filtered: float, limit: float, find: Callable[[], Finding]) -> TripRequest:
    """Return the request to trip for a disturbance that was too large for too long.

    Parameters
    ----------
    t
        s, device time.
    filtered
        rad/s2, mean over 10 ms.
    limit
        rad/s2.
    find
        Finds the likely cause, which takes longer than 0 V may wait.
    """
    figures = (
        f"{filtered:.0f} rad/s2 unexplained (10 ms mean) at t = {t:.3f} s; the limit is {limit:g} rad/s2."
    )
    explain = partial(_explanation, figures, find)
    return TripRequest("disturbance", f"Unknown forces: {figures}", "", explain=explain)


def _explanation(figures: str, find: Callable[[], Finding]) -> Explanation:
    reason, sentence, remedy = find()
    return Explanation(reason, f"{sentence}: {figures}", remedy)


def filter_keep(period: float) -> float:
    """Return how much of the filtered disturbance is left after a period (s)."""
    return math.exp(-period / _FILTER_TIME_S)


def cycles_above(period: float, time: float = _ABOVE_TIME_S) -> int:
    """Return the cycles of a period (s) that the disturbance may not stay above its limit; `time` in s."""
    return max(1, round(time / period))
