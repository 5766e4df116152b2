"""The host's supervisor: the states of a run as a table, monitors, and the last word on every voltage."""

from __future__ import annotations

import math
from enum import Enum, StrEnum, auto
from typing import TYPE_CHECKING

from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.values import Event, EventKind, PhaseData

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from dcmp_hil.safety.limiter import Limiter
    from dcmp_hil.safety.polarity_check import MotorGain, PolarityCheck
    from dcmp_hil.trip_request import Check
    from dcmp_hil.values import Estimate, Sample


class Phase(StrEnum):
    """Phases of a run."""

    ARMING = "arming"  # the backend has the device in RUN at 0 V; no sample yet
    PROBING = "probing"  # a volt up and down: which way does the arm go
    SETTLING = "settling"  # 0 V while the observer finds the arm
    ENGAGING = "engaging"  # the trajectory runs, authority grows
    RUNNING = "running"  # full authority
    STOPPING = "stopping"  # an orderly end: authority shrinks to 0 V
    TRIPPED = "tripped"  # 0 V for good


class PhaseEvent(Enum):
    """Conditions that lead from one phase of a run to the next."""

    ARMED = auto()  # the first sample, and a probe is wanted
    ARMED_UNPROBED = auto()  # the first sample, and none is
    PROBED = auto()
    SETTLED = auto()
    ENGAGED = auto()
    FAULT = auto()  # a check that objects with Urgency.NOW
    CONCERN = auto()  # one that leaves time for an orderly end: Urgency.RAMP
    STOPPED = auto()


TRANSITIONS: Mapping[Phase, Mapping[PhaseEvent, Phase]] = {
    Phase.ARMING: {
        PhaseEvent.ARMED: Phase.PROBING,
        PhaseEvent.ARMED_UNPROBED: Phase.SETTLING,
        PhaseEvent.CONCERN: Phase.TRIPPED,
        PhaseEvent.FAULT: Phase.TRIPPED,
    },
    Phase.PROBING: {
        PhaseEvent.PROBED: Phase.SETTLING,
        PhaseEvent.CONCERN: Phase.TRIPPED,
        PhaseEvent.FAULT: Phase.TRIPPED,
    },
    Phase.SETTLING: {
        PhaseEvent.SETTLED: Phase.ENGAGING,
        PhaseEvent.CONCERN: Phase.TRIPPED,
        PhaseEvent.FAULT: Phase.TRIPPED,
    },
    Phase.ENGAGING: {
        PhaseEvent.ENGAGED: Phase.RUNNING,
        PhaseEvent.CONCERN: Phase.STOPPING,
        PhaseEvent.FAULT: Phase.TRIPPED,
    },
    Phase.RUNNING: {PhaseEvent.CONCERN: Phase.STOPPING, PhaseEvent.FAULT: Phase.TRIPPED},
    Phase.STOPPING: {PhaseEvent.STOPPED: Phase.TRIPPED, PhaseEvent.FAULT: Phase.TRIPPED},
    Phase.TRIPPED: {},
}
"""What follows what; an event that is not listed changes nothing. Nothing leads out of TRIPPED."""

_MINUS_INF, _INF = -math.inf, math.inf
_RAMP_TIME_S = 0.05  # s that an orderly end takes to 0 V


class Supervisor:
    """Decides whether the amplifier may live, and with how many volts.

    Parameters
    ----------
    checks
        Asked every cycle, in this order; the first objection is the cause.
    limiter
        Bounds what the loop asks for; its own check comes last.
    settle, engage
        s, the lengths of these two phases; 0 and 0 for an immediate start.
    notify
        Told of every change of phase.
    probe
        None to start without.

    Attributes
    ----------
    limiter, settle, engage, probe
        As given.
    limit_reference
        What of a reference the limiter allows.
    phase
        Where the run stands.
    stopping
        Whether an orderly end is under way: in a few periods the run is over.
    over
        Why the run is over; None while it is not. The loop has sent 0 V before it looks, and ends then.
    """

    def __init__(
        self,
        checks: Sequence[Check],
        limiter: Limiter,
        *,
        settle: float,
        engage: float,
        notify: Callable[[Event], None],
        probe: PolarityCheck | None = None,
    ) -> None:
        self._checks = tuple(one.check for one in checks)
        self.limiter = limiter
        self._limited = limiter.limit_voltage
        self.limit_reference = limiter.limit_reference
        self.settle, self.engage = settle, engage
        self._notify = notify
        self.probe = probe
        self._since = math.nan  # s, device time at which the present phase began
        self._push = 0.0  # V, what the probe wants
        self._refusal: TripRequest | None = None  # of the probe
        self._last = 0.0  # V, what was sent last
        self._stop_from = 0.0  # V, where an orderly end begins
        self._cause: TripRequest | None = None
        self.over: TripRequest | None = None
        self._has_authority = False  # in RUNNING; asked every cycle
        self.phase = Phase.ARMING
        self.stopping = False

    @property
    def motor_gain(self) -> MotorGain | None:
        """Result of the polarity check; None without one, and before its end."""
        return self.probe.found if self.probe else None

    def engages(self, sample: Sample) -> bool:
        """Move on to the phase of this period; True in the first of ENGAGING, when the trajectory starts."""
        if self._has_authority:
            return False
        if self.phase is Phase.ARMING:
            self._advance(PhaseEvent.ARMED if self.probe else PhaseEvent.ARMED_UNPROBED, sample.t)
        if self.phase is Phase.PROBING:
            self._go_on_probing(sample)
        if self.phase is Phase.SETTLING and sample.t - self._since >= self.settle:
            self._advance(PhaseEvent.SETTLED, sample.t)
            return True
        return False

    def safe_voltage(self, sample: Sample, estimate: Estimate, demand: float) -> float:
        """Return the voltage to send, V.

        Once a check has objected with `Urgency.NOW`, or the demand was no finite number, it is 0 V for good,
        and `over` says why: the loop sends that 0 V, records the period, and ends. After an objection with
        `Urgency.RAMP`, such as that of a limit that has acted for too long, it takes 50 ms to get there.
        """
        t = sample.t
        for check in self._checks:
            objection = check(sample, estimate)
            if objection is not None:
                self.stop(objection, t)
                break
        try:
            if not _MINUS_INF < demand < _INF:
                self.stop(not_finite_demand(t, demand), t)
        except TypeError:  # a bug, not a fault of the rig: no trip, but 0 V all the same on the way out
            raise TypeError(f"The controller returned {demand!r}; update() must return a voltage.") from None
        if not self._has_authority:
            self._leave_phase(t)
        self._last = voltage = (
            self._limited(t, demand, self._last) if self._has_authority else self._partial_voltage(t, demand)
        )
        if self.limiter.objection is not None:
            self.stop(self.limiter.objection, t)
            if self.over is not None:  # without authority there is nothing to lead to 0 V
                self._last = voltage = 0.0
        return voltage

    def stop(self, cause: TripRequest, t: float) -> None:
        """Begin to end the run in the period of device time `t` (s); the first cause wins."""
        self._cause = self._cause or cause
        self._advance(PhaseEvent.FAULT if cause.urgency is Urgency.NOW else PhaseEvent.CONCERN, t)

    def _go_on_probing(self, sample: Sample) -> None:
        assert self.probe is not None  # noqa: S101 - the table leads here only with one
        refusal = self.probe.check(sample)
        if refusal is not None:
            self._refusal = (
                refusal  # behind what the checks find in this cycle: a jump is no motion of the arm
            )
        elif self.probe.over:
            self._advance(PhaseEvent.PROBED, sample.t)
        else:
            most = self.limiter.voltage_limit
            self._push = max(-most, min(most, self.probe.voltage))

    def _leave_phase(self, t: float) -> None:
        """Leave PROBING where the probe has refused, ENGAGING with full authority, STOPPING with none."""
        if self._refusal is not None:
            self.stop(self._refusal, t)
        gone = t - self._since
        if self.phase is Phase.ENGAGING and not gone < self.engage:
            self._advance(PhaseEvent.ENGAGED, t)
        elif self.phase is Phase.STOPPING and not gone < _RAMP_TIME_S:
            self._advance(PhaseEvent.STOPPED, t)

    def _partial_voltage(self, t: float, demand: float) -> float:
        """Return the voltage in every phase but RUNNING, V."""
        if self.phase is Phase.PROBING:
            return self._push
        gone, most = t - self._since, 0.0
        if self.phase is Phase.ENGAGING and gone > 0.0:  # at 0 an infinite limit would give NaN
            most = self.limiter.voltage_limit * gone / self.engage
        elif self.phase is Phase.STOPPING:
            most = self._stop_from * (1.0 - gone / _RAMP_TIME_S)
        if not most > 0.0:
            return 0.0
        return self.limiter.limit_slew(max(-most, min(most, demand)), self._last)

    def _advance(self, event: PhaseEvent, t: float) -> None:
        following = TRANSITIONS[self.phase].get(event)
        if following is None:
            return
        self.phase, self._since = following, t
        self._has_authority = following is Phase.RUNNING
        self.stopping, self._stop_from = following is Phase.STOPPING, abs(self._last)
        if following is Phase.TRIPPED and self._cause is not None:
            self.over = self._cause._replace(orderly=event is PhaseEvent.STOPPED)
        self._notify(phase_event(t, following))


def phase_event(t: float, phase: Phase) -> Event:
    """Return the event of a phase that began at `t` (s, device time)."""
    return Event(t, "INFO", EventKind.PHASE, phase.value, PhaseData(phase.value))


def not_finite_demand(t: float, demand: float) -> TripRequest:
    """Return the request to trip for a demand (V) that is no finite number, at `t` (s, device time)."""
    return TripRequest(
        "not_finite",
        f"The controller asked for {demand} V at t = {t:.3f} s.",
        "Look for a division by zero or a missing value in the controller.",
    )
