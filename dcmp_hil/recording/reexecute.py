"""A recorded run through observer and controller again: the same gains give the same numbers, to the bit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil import loop
from dcmp_hil.assembly import make_controller, make_friction, make_observer, make_predictor
from dcmp_hil.control.numerics_1 import observer_1, predictor_1
from dcmp_hil.control.references.table import Table
from dcmp_hil.control.trajectory import Trajectory
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.mailbox import Mailbox
from dcmp_hil.live.live_changes import LiveChanges
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.plugins.checked import failure_of
from dcmp_hil.recording.recorded_changes import changes_in
from dcmp_hil.recording.replay_backend import (
    RecordedSupervisor,
    RecordedTrajectory,
    RepeatedChanges,
    ReplayBackend,
    ReplayTelemetry,
)
from dcmp_hil.recording.schema import NUMERICS_1
from dcmp_hil.recording.untrusted import UnreadTable, check_numbers, refuse_named
from dcmp_hil.safety.deadline_monitor import DeadlineMonitor
from dcmp_hil.safety.outlier_filter import OutlierFilter
from dcmp_hil.values import EventKind

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.control.observers import Observer, Predictor
    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.recording.recorded_changes import UnrepeatedChange
    from dcmp_hil.values import Event


@dataclass(frozen=True)
class Reexecution:
    """Estimates and demands of observer and controller for the samples of a run.

    Parameters
    ----------
    estimate
        Position, velocity, disturbance in SI units, shape (n, 3).
    demand
        V, shape (n,).
    unrepeated
        Changes that were made in the run, and not in this repetition.
    """

    estimate: NDArray[np.float64]
    demand: NDArray[np.float64]
    unrepeated: tuple[UnrepeatedChange, ...] = ()


def reexecute(
    recorded: RecordedRun, rig: Rig | None = None, *, pinned: Collection[str] = (), trust: bool = False
) -> Reexecution:
    """Run the loop over a recording: its samples, references and voltages are as they were.

    Changes that were made while it went on are made again, in the same cycle. What cannot be made with this
    rig, and what was changed of a pinned key, is left out, and is in `unrepeated`.

    What was measured stays as it was: a controller that asks for something else does not move this arm.

    Parameters
    ----------
    recorded
        The run.
    rig
        Another observer or controller; None takes those of the run.
    pinned
        Dotted keys that keep what `rig` says; what the run changed them to is left out.
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
        return _reexecute(recorded, rig, trajectory, pinned)
    except (ArithmeticError, ValueError) as error:
        raise ConfigError(
            f"{recorded.path}: its numbers are beyond what observer and controller can take ({error})."
        ) from None


def _reexecute(
    recorded: RecordedRun, rig: Rig, trajectory: Trajectory, pinned: Collection[str]
) -> Reexecution:
    backend, outcomes = ReplayBackend(recorded.rows), ReplayTelemetry()
    (observer, predictor), controller = _observer(recorded, rig), make_controller(rig)
    mailbox = Mailbox()
    changes = LiveChanges(mailbox, trajectory, controller, observer, delay=rig.delay, notify=_ignore_event)
    found = changes_in(recorded.events, rig, pinned)
    repeated = RepeatedChanges(found.made, mailbox, changes)
    stages = loop.LoopStages(
        backend=backend,
        outlier_filter=OutlierFilter(math.inf, rig.period, rig.encoder.count),  # outliers are missing already
        observer=observer,
        predictor=predictor,
        trajectory=RecordedTrajectory(backend, trajectory),
        controller=controller,
        supervisor=RecordedSupervisor(backend),
        telemetry=outcomes,
        deadline_monitor=DeadlineMonitor(rig.period),
        clock=SimulatedClock(),
        delay=rig.delay,
        changes=repeated,
        friction=make_friction(rig),
    )
    _run(stages, backend, [event.t for event in recorded.events if event.kind is EventKind.LOWERING])
    again = Reexecution(
        np.array(outcomes.estimates, float).reshape(-1, 3),
        np.array(outcomes.demands, float),
        (*found.unrepeated, *repeated.refused),
    )
    _check_own(again, observer, controller)
    return again


def _observer(recorded: RecordedRun, rig: Rig) -> tuple[Observer, Predictor]:
    """Make observer and predictor by the numerics of the recording."""
    if recorded.run["numerics"] != NUMERICS_1:
        observer = make_observer(rig)
        return observer, make_predictor(rig, observer)
    observer = observer_1(rig.observer, rig.observer_context) or make_observer(rig)
    measured, context = rig.controller.position == "measured", rig.observer_context
    return observer, predictor_1(observer, context, rig.loop.delay_samples, measured=measured)


def _run(stages: loop.LoopStages, backend: ReplayBackend, lowered: Sequence[float]) -> None:
    """Run the loop to the end of the recording; at each time of `lowered`, s, the way down begins."""
    for until in (*lowered, math.inf):
        if not backend.requested:
            loop.run(stages, until, backend)
        if not backend.requested:
            stages.trajectory.lower(until + stages.delay)


def _check_own(again: Reexecution, *stages: object) -> None:
    """Refuse what a class of the user's own failed at, unless the recorded run ended there."""
    failed = np.isnan(again.demand) | np.isnan(again.estimate).any(axis=1)
    for stage in stages:
        failure = failure_of(stage)
        if failure is not None and failure.reason == "plugin" and failed[:-1].any():
            raise ConfigError(f"period {int(np.argmax(failed)) + 1}: {failure.error()}") from failure.cause


def _ignore_event(_: Event) -> None:
    """Drop the event: the recording holds it already."""
