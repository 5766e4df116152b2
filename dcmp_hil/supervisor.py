"""The host's supervisor: the states of a run as a table, monitors, and the last word on every voltage."""

from __future__ import annotations

import math
from enum import Enum, StrEnum, auto
from typing import TYPE_CHECKING

from dcmp_hil.errors import TripError
from dcmp_hil.values import Event

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from dcmp_hil.monitors import Monitor
    from dcmp_hil.probe import Probe
    from dcmp_hil.values import Estimate, Sample


class Phase(StrEnum):
    """Where a run stands."""

    ARMING = "arming"  # the backend has the device in RUN at 0 V; no sample yet
    PROBING = "probing"  # a volt up and down: which way does the arm go
    SETTLING = "settling"  # 0 V while the observer finds the arm
    ENGAGING = "engaging"  # the trajectory runs, authority grows
    RUNNING = "running"  # full authority
    TRIPPED = "tripped"  # 0 V for good


class Cue(Enum):
    """What moves a run on."""

    ARMED = auto()  # the first sample, and a probe is wanted
    ARMED_UNPROBED = auto()  # the first sample, and none is
    PROBED = auto()
    SETTLED = auto()
    ENGAGED = auto()
    FAULT = auto()  # a monitor objects, the probe refuses, or the device reports a fault


TABLE: Mapping[Phase, Mapping[Cue, Phase]] = {
    Phase.ARMING: {
        Cue.ARMED: Phase.PROBING,
        Cue.ARMED_UNPROBED: Phase.SETTLING,
        Cue.FAULT: Phase.TRIPPED,
    },
    Phase.PROBING: {Cue.PROBED: Phase.SETTLING, Cue.FAULT: Phase.TRIPPED},
    Phase.SETTLING: {Cue.SETTLED: Phase.ENGAGING, Cue.FAULT: Phase.TRIPPED},
    Phase.ENGAGING: {Cue.ENGAGED: Phase.RUNNING, Cue.FAULT: Phase.TRIPPED},
    Phase.RUNNING: {Cue.FAULT: Phase.TRIPPED},
    Phase.TRIPPED: {},
}
"""What follows what; a cue that is not listed changes nothing. Nothing leads out of TRIPPED."""

_CLAMP_SAID_EVERY = 1.0  # s


class Supervisor:
    """Decides whether the amplifier may live, and with how many volts.

    Parameters
    ----------
    monitors
        Checked every period, in this order.
    voltage_limit
        V, either way; infinity on a rig that has none.
    settle, engage
        s, the lengths of these two phases; 0 and 0 for an immediate start.
    notify
        Told of every change of phase, and of clamped voltages.
    probe
        None to start without.
    """

    def __init__(
        self,
        monitors: Sequence[Monitor],
        *,
        voltage_limit: float,
        settle: float,
        engage: float,
        notify: Callable[[Event], None],
        probe: Probe | None = None,
    ) -> None:
        self._checks = tuple(monitor.check for monitor in monitors)
        self._limit = voltage_limit
        self._settle, self._engage = settle, engage
        self._notify = notify
        self._probe = probe
        self._since = math.nan  # s, device time at which the present phase began
        self._push = 0.0  # V, what the probe wants
        self.phase = Phase.ARMING
        self._has_authority = False  # in RUNNING; asked every period
        self.trip: TripError | None = None
        self.clamped = 0  # periods in which the demand was more than the limit
        self._clamp_said = -math.inf

    def engages(self, sample: Sample) -> bool:
        """Move on to the phase of this period; True in the first of ENGAGING, when the trajectory starts."""
        if self._has_authority:
            return False
        if self.phase is Phase.ARMING:
            self._cue(Cue.ARMED if self._probe else Cue.ARMED_UNPROBED, sample.t)
        if self.phase is Phase.PROBING:
            self._go_on_probing(sample)
        if self.phase is Phase.SETTLING and sample.t - self._since >= self._settle:
            self._cue(Cue.SETTLED, sample.t)
            return True
        return False

    def admit(self, sample: Sample, estimate: Estimate, demand: float) -> float:
        """Return the voltage to send, V.

        Once a monitor has objected, the probe has refused, or the demand was no finite number, it is 0 V for
        good, and `trip` says why: the loop sends that 0 V, records the period, and ends.
        """
        try:
            for check in self._checks:
                check(sample, estimate)
            _check_finite(sample, demand)
        except TripError as trip:
            self._trip(trip, sample.t)
        limit = self._limit if self._has_authority else self._growing_limit(sample.t)
        if self.phase is Phase.PROBING:
            return self._push
        if -limit <= demand <= limit:
            return demand
        if self._has_authority:  # before, the limit is meant to bite
            self._note_clamp(sample.t, demand, limit)
        return limit if demand > 0.0 else -limit

    def _go_on_probing(self, sample: Sample) -> None:
        assert self._probe is not None  # noqa: S101 - the table leads here only with one
        try:
            push = self._probe.voltage_at(sample.t, sample.position)
        except TripError as trip:
            self._trip(trip, sample.t)
            return
        if push is None:
            self._cue(Cue.PROBED, sample.t)
        else:
            self._push = max(-self._limit, min(self._limit, push))

    def _trip(self, trip: TripError, t: float) -> None:
        self.trip = self.trip or trip  # the first cause wins
        self._cue(Cue.FAULT, t)

    def _note_clamp(self, t: float, demand: float, limit: float) -> None:
        """Count, and say so at most once a second."""
        self.clamped += 1
        if not t - self._clamp_said < _CLAMP_SAID_EVERY:
            self._clamp_said = t
            self._notify(
                Event(t, "WARN", f"voltage limited: {demand:.1f} V asked for, {limit:.1f} V allowed")
            )

    def _growing_limit(self, t: float) -> float:
        """Return the authority in every phase but RUNNING, V; full authority ends ENGAGING."""
        if self.phase is not Phase.ENGAGING:
            return 0.0
        gone = t - self._since
        if gone < self._engage:
            return self._limit * gone / self._engage if gone > 0.0 else 0.0  # the limit may be infinite
        self._cue(Cue.ENGAGED, t)
        return self._limit

    def _cue(self, cue: Cue, t: float) -> None:
        following = TABLE[self.phase].get(cue)
        if following is not None:
            self.phase, self._since = following, t
            self._has_authority = following is Phase.RUNNING
            self._notify(Event(t, "PHASE", following.value))


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
