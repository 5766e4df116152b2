"""The loop: one cycle is one straight line, and everything else exists to keep it so."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.live.live_changes import NoChanges
from dcmp_hil.values import Cycle, Timing

if TYPE_CHECKING:
    from dcmp_hil.backend import Backend
    from dcmp_hil.control.controllers import Controller
    from dcmp_hil.control.friction_feedforward import FrictionFeedforward
    from dcmp_hil.control.observers import Observer, Predictor
    from dcmp_hil.live.live_changes import Changes
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.safety.deadline_monitor import DeadlineMonitor
    from dcmp_hil.safety.outlier_filter import OutlierFilter
    from dcmp_hil.safety.polarity_check import MotorGain
    from dcmp_hil.trip_request import TripRequest
    from dcmp_hil.values import Estimate, Reference, Sample


class TrajectoryStage(Protocol):
    """Protocol of the trajectory: `dcmp_hil.control.trajectory.Trajectory`, or that of a recording."""

    def hold(self, position: float) -> None:
        """Stay at `position` (rad) until the trajectory begins."""
        ...

    def begin(self, t: float, position: float) -> None:
        """Begin at device time `t` (s), from `position` (rad)."""
        ...

    def lower(self, t: float) -> None:
        """Go down to hanging from device time `t` (s) on."""
        ...

    def at(self, t: float) -> Reference:
        """Return the reference at device time `t` (s)."""
        ...

    def velocity(self, t: float) -> float:
        """Return the velocity of the reference at device time `t` (s), rad/s."""
        ...


class SupervisorStage(Protocol):
    """Protocol of the last word: `dcmp_hil.safety.supervisor.Supervisor`, or that of a recording."""

    over: TripRequest | None
    stopping: bool

    @property
    def motor_gain(self) -> MotorGain | None:
        """Result of the polarity check; None without one."""
        ...

    def engages(self, sample: Sample) -> bool:
        """Return whether the trajectory begins in this cycle."""
        ...

    def limit_reference(self, sample: Sample, reference: Reference, /) -> Reference:
        """Return what of a reference is allowed."""
        ...

    def safe_voltage(self, sample: Sample, estimate: Estimate, demand: float) -> float:
        """Return the voltage to send, V."""
        ...

    def stop(self, cause: TripRequest, t: float) -> None:
        """Begin to end the run in the cycle of device time `t` (s)."""
        ...


class Telemetry(Protocol):
    """A receiver of the loop's cycles; `record` must return at once."""

    def record(self, cycle: Cycle) -> None:
        """Take the values of one cycle; must return at once."""
        ...


class StopFlag(Protocol):
    """Whether the end was requested."""

    requested: bool


@dataclass(frozen=True, slots=True)
class LoopStages:
    """The stages of a cycle, in the order in which a sample passes them."""

    backend: Backend
    outlier_filter: OutlierFilter
    observer: Observer
    predictor: Predictor
    trajectory: TrajectoryStage
    controller: Controller
    supervisor: SupervisorStage
    telemetry: Telemetry
    deadline_monitor: DeadlineMonitor
    clock: Clock
    delay: float  # s, from a sample to the instant at which its command acts
    changes: Changes = field(default_factory=NoChanges)
    friction: FrictionFeedforward | None = None


def run(stages: LoopStages, until: float, stop: StopFlag) -> float:
    """Run cycles until device time reaches `until`, or the end is requested.

    The backend must be open, and its owner closes it: that drives 0 V however this function ends.

    Parameters
    ----------
    stages
        The stages of a cycle.
    until
        s, device time; the period whose sample is at or after it is the last.
    stop
        Checked once a cycle.

    Returns
    -------
    float
        Device time of the last sample, s.

    Raises
    ------
    TripError
        If the supervisor trips; 0 V has been written by then.
    DeadlineError
        If too many periods were late, and the rig says that this is the end.
    BackendError
        If the device or the way to it fails.
    """
    backend, outlier_filter, observer, predictor = (
        stages.backend, stages.outlier_filter, stages.observer, stages.predictor,
    )  # fmt: skip
    trajectory, controller, supervisor, telemetry = (
        stages.trajectory, stages.controller, stages.supervisor, stages.telemetry,
    )  # fmt: skip
    deadline_monitor, clock, delay, changes, friction = (
        stages.deadline_monitor, stages.clock, stages.delay, stages.changes, stages.friction,
    )  # fmt: skip
    previous, first = math.nan, math.nan

    while True:
        sample = backend.read()
        while outlier_filter.reject(sample):  # as if it had been lost: the device holds its voltage
            sample = backend.read()
        t = sample.t
        arrived = clock.now_ns() * 1e-9
        told = sample if friction is None else friction.told(sample, trajectory.velocity(friction.middle(t)))
        rest = observer.update(told)
        estimate = rest if friction is None else friction.whole(rest, trajectory.velocity(t + delay))
        if first != first:
            first = arrived - t
            trajectory.hold(estimate.position)
        if supervisor.engages(sample):
            trajectory.begin(t, estimate.position)
        reference = supervisor.limit_reference(sample, trajectory.at(t + delay))
        ahead = predictor.ahead(sample, estimate, reference)
        demand = controller.update(reference, ahead)
        voltage = supervisor.safe_voltage(sample, estimate, demand)
        backend.write(voltage)
        predictor.sent(voltage)
        left = clock.now_ns() * 1e-9
        timing = make(Timing, (arrived - previous, arrived - first - t, left - arrived))  # 0.09 us less
        telemetry.record(make(Cycle, (sample, estimate, reference, demand, voltage, timing)))  # 0.11 us less
        previous = arrived
        changes.apply(t)

        late = deadline_monitor.check(timing)
        if supervisor.over is not None:  # 0 V has been sent
            raise supervisor.over.error()
        if late is not None:
            supervisor.stop(late, t)
        if (t >= until or stop.requested) and not supervisor.stopping:
            return t
