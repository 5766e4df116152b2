"""Engines of a run: the loop of the host, or a core with many cycles in one call; both give the same bits."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple, Protocol

from dcmp_hil import loop
from dcmp_hil.control.trajectory import LOWERING_TIME_S
from dcmp_hil.plugins.named_class import find_named
from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from dcmp_hil.loop import LoopStages, StopFlag
    from dcmp_hil.safety.polarity_check import MotorGain
    from dcmp_hil.telemetry.recorder import Recorder

CORE, PLAIN = "core", "plain"
"""Names of the engines, as `Result.engine` tells them."""
ENGINE = "sim_backend.core_run.engine:CoreEngine"
"""`module:Class` of the core, made as Class() once; it keeps no state, and making it raises nothing."""


class Cycles(Protocol):
    """Protocol of what runs the cycles of one run."""

    def run(self, until: float, stop: StopFlag) -> float:
        """Run cycles as `dcmp_hil.loop.run` does; return the device time of the last sample, s."""
        ...

    def lower(self, t: float) -> None:
        """Let the reference go down to hanging from device time `t` (s) on."""
        ...

    @property
    def outliers(self) -> int:
        """Samples left out so far."""
        ...

    @property
    def motor_gain(self) -> MotorGain | None:
        """Result of the polarity check; None without one, and before its end."""
        ...


class RunEngine(Protocol):
    """Protocol of an engine of runs in virtual time."""

    def refusal(self, rig: Rig, stages: LoopStages, recorder: Recorder) -> str:
        """Return why the engine cannot run these stages, in a sentence; empty if it can.

        The answer depends on the classes of the stages, not on what they are called.
        """
        ...

    def cycles(self, rig: Rig, stages: LoopStages, recorder: Recorder) -> Cycles:
        """Return what runs stages that are not refused; rows and events go to the recorder."""
        ...


class LoopCycles:
    """The cycles of the loop of the host.

    Parameters
    ----------
    stages
        Of the loop.
    """

    def __init__(self, stages: LoopStages) -> None:
        self._stages = stages

    def run(self, until: float, stop: StopFlag) -> float:
        """Run cycles until `until` (s, device time); return the device time of the last sample, s."""
        return loop.run(self._stages, until, stop)

    def lower(self, t: float) -> None:
        """Let the reference go down to hanging from device time `t` (s) on."""
        self._stages.trajectory.lower(t)

    @property
    def outliers(self) -> int:
        """Samples left out so far."""
        return self._stages.outlier_filter.count

    @property
    def motor_gain(self) -> MotorGain | None:
        """Result of the polarity check; None without one, and before its end."""
        return self._stages.supervisor.motor_gain


class RunDrive(NamedTuple):
    """Runner of the cycles, name of its engine, and why that is not the core; empty if it is."""

    cycles: Cycles
    engine: str
    reason: str = ""


def loop_drive(stages: LoopStages, reason: str = "") -> RunDrive:
    """Return the loop of the host."""
    return RunDrive(LoopCycles(stages), PLAIN, reason)


@cache
def _core() -> RunEngine:
    make: Callable[[], RunEngine] = find_named(ENGINE, "engine")
    return make()


def fastest_drive(rig: Rig, stages: LoopStages, recorder: Recorder, *, looked_at: bool) -> RunDrive:
    """Return the core for a run in virtual time, or the loop where the core cannot run its stages.

    Parameters
    ----------
    rig, stages, recorder
        Of the run.
    looked_at
        Whether sinks of the user look at the blocks: these are then cut as the loop cuts them.
    """
    engine = _core()
    reason = engine.refusal(rig, stages, recorder)
    if reason:
        return loop_drive(stages, reason)
    recorder.take_batches(large=not looked_at and not recorder.further)
    return RunDrive(engine.cycles(rig, stages, recorder), CORE)


def run_to_end(cycles: Cycles, rig: Rig, length: float, recorder: Recorder, stop: StopFlag) -> None:
    """Run for `length` (s), and lower the arm where the rig asks for it."""
    t = cycles.run(length - 1.5 * rig.period, stop)
    if rig.run.end == "lower" and not stop.requested:
        recorder.event(Event(t, "INFO", EventKind.LOWERING, "lowering the arm"))
        cycles.lower(t + rig.delay)
        cycles.run(t + rig.delay + LOWERING_TIME_S, stop)
