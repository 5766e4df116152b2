"""The host's supervisor: phases of a run, monitors, and the last word on every voltage."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING

from dcmp_hil.errors import TripError
from dcmp_hil.values import Event

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.monitors import Monitor
    from dcmp_hil.values import Estimate, Sample


class Phase(StrEnum):
    """Where a run stands."""

    SETTLING = "settling"  # 0 V while the observer finds the arm
    ENGAGING = "engaging"  # the trajectory runs, authority grows
    RUNNING = "running"  # full authority


class Supervisor:
    """Decides whether the amplifier may live, and with how many volts.

    Parameters
    ----------
    monitors
        Checked every period, in this order.
    voltage_limit
        V, either way; infinity on a rig that has none.
    settle, engage
        s, the lengths of the first two phases; 0 and 0 for an immediate start.
    notify
        Told of every change of phase, and of clamped voltages.
    """

    def __init__(
        self,
        monitors: Sequence[Monitor],
        *,
        voltage_limit: float,
        settle: float,
        engage: float,
        notify: Callable[[Event], None],
    ) -> None:
        self._checks = tuple(monitor.check for monitor in monitors)
        self._limit = voltage_limit
        self._settle, self._engage = settle, engage
        self._since = math.nan  # s, device time at which the present phase began
        self.phase = Phase.SETTLING
        self.trip: TripError | None = None
        self.clamped = 0  # periods in which the demand was more than the limit
        self._clamp_said = -math.inf
        self._notify = notify

    def engages(self, sample: Sample) -> bool:
        """Return True in the first period of ENGAGING, when the trajectory's clock starts."""
        if self.phase is not Phase.SETTLING:
            return False
        if math.isnan(self._since):
            self._enter(Phase.SETTLING, sample.t)
        if sample.t - self._since < self._settle:
            return False
        self._enter(Phase.ENGAGING, sample.t)
        return True

    def admit(self, sample: Sample, estimate: Estimate, demand: float) -> float:
        """Return the voltage to send, V.

        Once a monitor has objected, or the demand was no finite number, it is 0 V for good, and `trip`
        says why: the loop sends that 0 V, records the period, and ends.
        """
        try:
            for check in self._checks:
                check(sample, estimate)
            _check_finite(sample, demand)
        except TripError as trip:
            self.trip = self.trip or trip
        if self.trip is not None:
            return 0.0
        limit = self._limit if self.phase is Phase.RUNNING else self._growing_limit(sample.t)
        if -limit <= demand <= limit:
            return demand
        if self.phase is Phase.RUNNING:  # before, the limit is meant to bite
            self._note_clamp(sample.t, demand, limit)
        return limit if demand > 0.0 else -limit

    def _note_clamp(self, t: float, demand: float, limit: float) -> None:
        """Count, and say so at most once a second."""
        self.clamped += 1
        if not t - self._clamp_said < 1.0:
            self._clamp_said = t
            self._notify(
                Event(t, "WARN", f"voltage limited: {demand:.1f} V asked for, {limit:.1f} V allowed")
            )

    def _growing_limit(self, t: float) -> float:
        """Return the authority of the first two phases, V; full authority ends the second."""
        if self.phase is Phase.SETTLING:
            return 0.0
        gone = t - self._since
        if gone < self._engage:
            return self._limit * gone / self._engage if gone > 0.0 else 0.0  # the limit may be infinite
        self._enter(Phase.RUNNING, t)
        return self._limit

    def _enter(self, phase: Phase, t: float) -> None:
        self.phase, self._since = phase, t
        self._notify(Event(t, "PHASE", phase.value))


def _check_finite(sample: Sample, demand: float) -> None:
    try:
        finite = -math.inf < demand < math.inf
    except TypeError:  # a bug, not a fault of the rig: no trip, but 0 V all the same on the way out
        raise TypeError(f"The controller returned {demand!r}; update() must return a voltage.") from None
    if not finite:
        raise TripError(
            "not_finite",
            f"The controller asked for {demand} V at t = {sample.t:.3f} s.",
            "Look for a division by zero or a missing value in the controller.",
        )
