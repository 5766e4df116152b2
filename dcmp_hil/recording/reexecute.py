"""A recorded run through observer and controller again: the same gains give the same numbers, to the bit."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.assembly import make_controller, make_observer
from dcmp_hil.control.predictor import Predictor
from dcmp_hil.control.references.table import Table
from dcmp_hil.control.trajectory import Trajectory
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.mailbox import Mailbox
from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.live.live_changes import LiveChanges
from dcmp_hil.plugins.checked import failure_of
from dcmp_hil.recording.recorded_changes import changes_in
from dcmp_hil.recording.untrusted import UnreadTable, check_numbers, refuse_named
from dcmp_hil.values import EventKind, Reference, Sample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.values import Estimate, Event

_FIELD_NUMBERS = {name: place for place, name in enumerate(FIELDS)}


@dataclass(frozen=True)
class Reexecution:
    """Estimates and demands of observer and controller for the samples of a run.

    Parameters
    ----------
    estimate
        Position, velocity, disturbance in SI units, shape (n, 3).
    demand
        V, shape (n,).
    """

    estimate: NDArray[np.float64]
    demand: NDArray[np.float64]


def reexecute(recorded: RecordedRun, rig: Rig | None = None, *, trust: bool = False) -> Reexecution:
    """Hand the recorded samples, references and voltages to observer, predictor and controller.

    Changes that were made while it went on are made again, in the same cycle.

    What was measured stays as it was: a controller that asks for something else does not move this arm.

    Parameters
    ----------
    recorded
        The run.
    rig
        Another observer or controller; None takes those of the run.
    trust
        Whether what the recording itself names may be imported, or read: classes, a reference's file.

    Raises
    ------
    ConfigError
        If a class of the user's own cannot be made, or fails in a period that the run survived; if the
        recording names one and is not trusted; if it holds numbers that no run has.
    """
    rig = rig or recorded.rig
    if not trust:
        refuse_named(recorded, rig)
    check_numbers(recorded)
    source = rig.reference.source()
    if isinstance(rig.reference, Table) and not trust and rig.reference == recorded.rig.reference:
        source = UnreadTable(recorded.path, rig.reference)
    trajectory = Trajectory(source, rig.reference.soft_start_s)
    try:
        return _reexecute(recorded, rig, trajectory)
    except (ArithmeticError, ValueError) as error:
        raise ConfigError(
            f"{recorded.path}: its numbers are beyond what observer and controller can take ({error})."
        ) from None


def _reexecute(recorded: RecordedRun, rig: Rig, trajectory: Trajectory) -> Reexecution:
    observer, controller = make_observer(rig, trajectory), make_controller(rig)
    measured = rig.controller.position == "measured"
    predictor = Predictor(rig.model.values(), rig.period, rig.loop.delay_samples, measured=measured)
    past = _Past(recorded, trajectory, rig.delay)
    mailbox = Mailbox()
    changes = LiveChanges(mailbox, trajectory, controller, observer, delay=rig.delay, notify=_ignore_event)
    made = deque(changes_in(recorded.events, rig, whole=not recorded.damage))
    estimates, demands = [], []
    for row in recorded.rows.tolist():
        sample = Sample(row[0], row[1], row[2], int(row[3]))
        estimate = observer.update(sample)
        past.follow(row, estimate)
        ahead = predictor.ahead(sample, estimate)
        demands.append(controller.update(Reference(*row[_FIELD_NUMBERS["position_ahead"] :][:3]), ahead))
        predictor.sent(row[_FIELD_NUMBERS["voltage_sent"]])
        estimates.append(estimate)
        if made and made[0][0] <= sample.t:  # later where the period itself is missing
            mailbox.put(made.popleft()[1])
        changes.apply(sample.t)
    again = Reexecution(np.array(estimates, float).reshape(-1, 3), np.array(demands, float))
    _check_own(again, observer, controller)
    return again


def _check_own(again: Reexecution, *stages: object) -> None:
    """Refuse what a class of the user's own failed at, unless the recorded run ended there."""
    failed = np.isnan(again.demand) | np.isnan(again.estimate).any(axis=1)
    for stage in stages:
        failure = failure_of(stage)
        if failure is not None and failure.reason == "plugin" and failed[:-1].any():
            raise ConfigError(f"period {int(np.argmax(failed)) + 1}: {failure.error()}") from failure.cause


def _ignore_event(_: Event) -> None:
    """Drop the event: the recording holds it already."""


class _Past:
    """Takes the trajectory through what happened to it: held, begun, lowered. Friction is told from it."""

    def __init__(self, recorded: RecordedRun, trajectory: Trajectory, delay: float) -> None:
        self._trajectory, self._delay = trajectory, delay
        self._lowered = deque(event.t for event in recorded.events if event.kind is EventKind.LOWERING)
        self._holds = True
        self._began = math.inf

    def follow(self, row: list[float], estimate: Estimate) -> None:
        """Repeat the trajectory's transitions of the recorded cycle."""
        t, began = row[0], row[_FIELD_NUMBERS["began"]]
        if self._holds:  # the first period of the run, and of the way down
            self._holds = False
            self._trajectory.hold(estimate.position)
        if began <= t and began != self._began:  # earlier where the period itself is missing
            self._began = began
            self._trajectory.begin(began, estimate.position)
        if self._lowered and self._lowered[0] <= t:
            self._trajectory.lower(self._lowered.popleft() + self._delay)
            self._holds = True
