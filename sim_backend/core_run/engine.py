"""The engine that runs whole cycles in the compiled core."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.control.controllers.pd_compensated import PdCompensated
from dcmp_hil.control.friction_feedforward import FrictionFeedforward
from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
from dcmp_hil.control.observers.friction_kalman.predictor import FrictionPredictor
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.control.predictor import LinearPredictor
from dcmp_hil.control.trajectory import Trajectory
from dcmp_hil.errors import OpenError
from dcmp_hil.live.live_changes import NoChanges
from dcmp_hil.safety.deadline_monitor import DeadlineMonitor
from dcmp_hil.safety.outlier_filter import OutlierFilter
from dcmp_hil.safety.supervisor import Supervisor
from sim_backend.backend import SimBackend
from sim_backend.core_run.cycles import CoreCycles
from sim_backend.core_run.library import load

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.config import Rig
    from dcmp_hil.loop import LoopStages
    from dcmp_hil.telemetry.recorder import Recorder
    from sim_backend.core_run.library import RunLibrary

_KNOWN = {
    "observer": (SuperTwisting, FrictionKalman),
    "predictor": (LinearPredictor, FrictionPredictor),
    "controller": (PdCompensated,),
    "trajectory": (Trajectory,),
    "supervisor": (Supervisor,),
    "outlier_filter": (OutlierFilter,),
    "deadline_monitor": (DeadlineMonitor,),
    "changes": (NoChanges,),
    "friction": (FrictionFeedforward, type(None)),
}
"""Stages of the loop, and the classes of them that the core has: exactly these, as a subclass may differ."""


class CoreEngine:
    """Runs rigs in the core; see `dcmp_hil.run_engine.RunEngine`.

    Parameters
    ----------
    library
        Loads the compiled core; it may raise OpenError, which is a refusal.
    """

    def __init__(self, library: Callable[[], RunLibrary] = load) -> None:
        self._library = library

    def refusal(self, rig: Rig, stages: LoopStages, recorder: Recorder) -> str:
        """Return why the core cannot run these stages, in a sentence; empty if it can."""
        return next(_reasons(rig, stages, recorder), "") or self._missing()

    def cycles(self, rig: Rig, stages: LoopStages, recorder: Recorder) -> CoreCycles:
        """Return what runs stages that are not refused; rows and events go to the recorder."""
        return CoreCycles(rig, stages, recorder, self._library())

    def _missing(self) -> str:
        """Return why there is no core on this computer."""
        try:
            self._library()
        except OpenError as error:
            return str(error)
        return ""


def _reasons(rig: Rig, stages: LoopStages, recorder: Recorder) -> Iterator[str]:
    backend = stages.backend
    if rig.backend.kind != "sim":
        yield f'the core simulates the rig itself: backend.kind is "{rig.backend.kind}", and not "sim".'
    elif type(backend) is not SimBackend:
        yield "the core injects no faults, and has no backend but its own."
    elif backend.why_not_core:
        yield backend.why_not_core
    for name, classes in _KNOWN.items():
        stage = getattr(stages, name)
        if type(stage) not in classes:
            yield f"the core has no {name.replace('_', ' ')} of the class {type(stage).__name__}."
    further = getattr(stages.observer, "DIAGNOSIS", ())
    if recorder.further != further:
        yield "the core runs no observers beside the loop."
