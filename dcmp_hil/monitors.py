"""Monitors: what may not happen while the amplifier is live, written so that NaN fails closed."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from dcmp_hil.diagnosis import Diagnosis
from dcmp_hil.errors import Explanation
from dcmp_hil.faults import meaning_of
from dcmp_hil.stop import Stop
from dcmp_hil.values import Fault

if TYPE_CHECKING:
    from dcmp_hil.observers import Observer, ObserverContext
    from dcmp_hil.values import Estimate, Sample

_HEALTHY = Fault.NONE  # found here faster than in its class


class Finite:
    """Every number of sample and estimate is finite, and the device is healthy: needed on every rig."""

    def check(self, sample: Sample, estimate: Estimate) -> Stop | None:
        """Object to NaN, infinity and a device fault."""
        t, position, voltage, fault = sample
        if fault != _HEALTHY:
            sentence, remedy = meaning_of(fault)
            return Stop("device_fault", f"{sentence} (fault {fault}, t = {t:.3f} s).", remedy)
        x1, x2, w = estimate
        if not -math.inf < t + position + voltage + x1 + x2 + w < math.inf:  # a sum with a NaN is one
            return Stop(
                "not_finite",
                f"Not every number is finite at t = {t:.3f} s: position {position}, voltage {voltage}, "
                f"estimate ({x1}, {x2}, {w}).",
                "Look for a gain that makes the observer diverge, and at the encoder.",
            )
        return None


class Ranges:
    """Position and velocity stay inside their limits.

    Parameters
    ----------
    position
        rad, either way from hanging.
    velocity
        rad/s, either way.
    """

    def __init__(self, position: float, velocity: float) -> None:
        self._position = position
        self._velocity = velocity

    def check(self, sample: Sample, estimate: Estimate) -> Stop | None:
        """Object outside the limits."""
        if not -self._velocity <= estimate.velocity <= self._velocity:
            return Stop(
                "speed",
                f"Estimated velocity {estimate.velocity:.2f} rad/s at t = {sample.t:.3f} s; "
                f"the limit is {self._velocity:g} rad/s.",
                "Check motor and encoder polarity, the gains, and supervisor.velocity_limit_rad_s.",
            )
        if not -self._position <= sample.position <= self._position:
            return Stop(
                "travel",
                f"Position {sample.position:.2f} rad at t = {sample.t:.3f} s; "
                f"the limit is {self._position:g} rad.",
                "Check the reference, the encoder's zero, and supervisor.position_limit_rad.",
            )
        return None


class DisturbanceWatch:
    """A second, faster observer: what it cannot explain by voltage and inertia must stay plausible.

    Diverging observers, reversed polarity, a stuck encoder and lost motor power all show as an absurd w_hat:
    first-order filtered over 10 ms it reaches 20 rad/s2 in the worst healthy run, 45 with 1.5 times the
    motor gain and no soft start.

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
    """

    def __init__(
        self, observer: Observer, setting: ObserverContext, limit: float, for_: float = 5e-3
    ) -> None:
        self._diagnosis = Diagnosis(setting)
        self._remember, self._update = self._diagnosis.add, observer.update
        self._keep = math.exp(-setting.period / 10e-3)
        self._limit = limit
        self._allowed = max(1, round(for_ / setting.period))
        self._filtered = 0.0
        self._above = 0

    def check(self, sample: Sample, estimate: Estimate) -> Stop | None:  # noqa: ARG002 - it has its own
        """Object if the disturbance was too large for too long; the stop can find the likely cause."""
        self._remember(sample)
        _, _, w = self._update(sample)
        self._filtered = filtered = w + self._keep * (self._filtered - w)
        if -self._limit <= filtered <= self._limit:
            self._above = 0
            return None
        self._above += 1
        if self._above < self._allowed and filtered == filtered:
            return None
        seen = (
            f"{filtered:.0f} rad/s2 unexplained (10 ms mean) at t = {sample.t:.3f} s; "
            f"the limit is {self._limit:g} rad/s2."
        )
        return Stop("disturbance", f"Unknown forces: {seen}", "", explain=partial(self._explanation, seen))

    def _explanation(self, seen: str) -> Explanation:
        """Find the likely cause, which takes longer than 0 V may wait."""
        reason, sentence, remedy = self._diagnosis.finding()
        return Explanation(reason, f"{sentence}: {seen}", remedy)
