"""From a rig to the stages of the loop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, cast

from dcmp_hil.config.compared_observers import OPTION, column_name, compared_sections
from dcmp_hil.config.sections import Custom
from dcmp_hil.config.stage_factory import controller_of, observer_of
from dcmp_hil.config.variation import expected_variation
from dcmp_hil.control import controllers
from dcmp_hil.control.friction_feedforward import FrictionFeedforward
from dcmp_hil.control.observers.super_twisting import SuperTwisting, watch_floor
from dcmp_hil.control.predictor import LinearPredictor
from dcmp_hil.control.shadow import Shadow, Shadows
from dcmp_hil.control.trajectory import Trajectory
from dcmp_hil.device.factory import open_backend
from dcmp_hil.errors import ConfigError
from dcmp_hil.fault_hooks import NO_FAULTS
from dcmp_hil.live.live_changes import LiveChanges, NoChanges
from dcmp_hil.loop import LoopStages
from dcmp_hil.safety.chatter import Chatter
from dcmp_hil.safety.deadline_monitor import DeadlineMonitor
from dcmp_hil.safety.limiter import Limiter
from dcmp_hil.safety.monitors import WATCHING_OBSERVER, DisturbanceWatch, FiniteMonitor, RangeMonitor
from dcmp_hil.safety.outlier_filter import OutlierFilter
from dcmp_hil.safety.polarity_check import probe_for
from dcmp_hil.safety.speed_resolution import resolution
from dcmp_hil.safety.supervisor import Supervisor
from dcmp_hil.telemetry.block import ReferenceAligner
from dcmp_hil.telemetry.diagnosis_columns import diagnosis_of
from dcmp_hil.telemetry.further_columns import fault_of, joined
from dcmp_hil.telemetry.recorder import Recorder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.control.controllers import Controller
    from dcmp_hil.control.observers import Observer, Predictor
    from dcmp_hil.fault_hooks import Faults
    from dcmp_hil.ipc.mailbox import Mailbox
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.platform.stop_request import StopRequest
    from dcmp_hil.telemetry.further_columns import FurtherColumns
    from dcmp_hil.telemetry.recorder import Sink
    from dcmp_hil.telemetry.telemetry_process import TelemetryProcess
    from dcmp_hil.trip_request import Check
    from dcmp_hil.values import Event

_SETTLING_TIME_S = 0.25  # ten time constants of the observer
_ENGAGING_TIME_S = 0.25  # then a ramp of authority


def assemble(
    rig: Rig,
    clock: Clock,
    sinks: Sequence[Sink],
    *,
    in_line: bool,
    apart: TelemetryProcess | None = None,
    mailbox: Mailbox | None = None,
    stop: StopRequest | None = None,
    clear: bool = False,
    faults: Faults = NO_FAULTS,
    laws: Laws | None = None,
) -> tuple[LoopStages, Recorder]:
    """Make every stage of the loop, and the recorder that it reports to.

    Parameters
    ----------
    laws
        From `make_laws`, whose further columns `apart` knows; None makes them here.

    Raises
    ------
    ConfigError
        If a class named `module:Class` cannot be found or made.
    """
    backend = open_backend(rig, clock, faults, clear=clear)
    trajectory = Trajectory(rig.reference.source(), rig.reference.soft_start_s)
    observer, controller, further = laws or make_laws(rig)
    recorder = Recorder(  # with its thread: nothing that may be refused comes after it
        backend.truth,
        ReferenceAligner(trajectory.at, rig.delay, lambda: trajectory.began),
        sinks,
        recent=max(1, round(rig.loop.rate_hz)),
        in_line=in_line,
        apart=apart,
        model=rig.model.values(),
        backend=backend,
        further=further,
    )
    chatter = make_chatter(rig)
    changes = mailbox and LiveChanges(
        mailbox,
        trajectory,
        controller,
        observer,
        delay=rig.delay,
        notify=recorder.event,
        stop=stop,
        chatter=chatter,
    )
    outlier_filter = make_outlier_filter(rig)
    sections = ((observer, rig.observer), (controller, rig.controller))
    own = [cast("Check", stage) for stage, section in sections if isinstance(section, Custom)]
    notify = changes.event if changes else recorder.event
    supervisor = make_supervisor(rig, notify, [outlier_filter, *own], chatter)
    stages = LoopStages(
        backend=backend,
        outlier_filter=outlier_filter,
        observer=faults.observer(observer),
        predictor=make_predictor(rig, observer),
        trajectory=trajectory,
        controller=faults.controller(controller),
        supervisor=supervisor,
        telemetry=recorder,
        deadline_monitor=DeadlineMonitor(
            rig.period, rig.timing.overrun_limit if rig.timing.overrun == "stop" else None
        ),
        clock=clock,
        delay=rig.delay,
        changes=changes or NoChanges(),
        friction=make_friction(rig),
    )
    return stages, recorder


class Laws(NamedTuple):
    """Observer and controller, which close the loop, and what they tell of themselves.

    Parameters
    ----------
    observer, controller
        As the rig asks for.
    further
        The further columns of the run.
    """

    observer: Observer
    controller: Controller
    further: FurtherColumns


def make_laws(rig: Rig, compare: Iterable[str] = ()) -> Laws:
    """Make observer and controller; what they tell of themselves is known before telemetry begins.

    Parameters
    ----------
    rig
        To be run.
    compare
        Observers that run beside the loop; see `make_shadows`.

    Raises
    ------
    ConfigError
        If a class named `module:Class` cannot be found or made, its diagnosis has names that are none, or an
        observer to compare with does not fit.
    """
    observer, controller = make_observer(rig), make_controller(rig)
    sources = diagnosis_of(observer, rig.observer.kind), make_shadows(rig, compare, controller)
    further = joined(sources)
    if fault := fault_of(further.names):
        raise ConfigError(f"The columns of diagnosis and --compare: {fault}. Compare fewer observers.")
    return Laws(observer, controller, further)


def make_observer(rig: Rig) -> Observer:
    """Make the observer that `[observer]` asks for."""
    return observer_of(rig.observer, rig.observer_context, rig.plugin_folders)


def make_friction(rig: Rig) -> FrictionFeedforward | None:
    """Make what takes friction from the observer, if `[controller]` asks for it."""
    return FrictionFeedforward(rig.model.values()) if rig.controller.feeds_friction_forward else None


def make_controller(rig: Rig) -> Controller:
    """Make the controller that `[controller]` asks for."""
    context = controllers.ControllerContext(rig.model.values(), rig.period)
    return controller_of(rig.controller, context, rig.plugin_folders)


def make_shadows(rig: Rig, kinds: Iterable[str], controller: Controller) -> Shadows:
    """Make the observers that only run beside the loop, each as `--set observer.kind=...` makes it.

    They share a controller of the package, which keeps no state, so that its present gains count.

    Raises
    ------
    ConfigError
        If one is none, or the rig is none for it.
    """
    shared = None if isinstance(rig.controller, Custom) else controller
    made = []
    for kind, section in compared_sections(rig, kinds).items():
        beside = rig.model_copy(update={"observer": section})
        observer = observer_of(section, rig.observer_context, rig.plugin_folders, OPTION)
        made.append(Shadow(column_name(kind), observer, make_predictor(beside, observer), shared))
    return Shadows(made)


def make_predictor(rig: Rig, observer: Observer) -> Predictor:
    """Make what carries the estimate to the instant at which a command acts: the observer's own, if any."""
    measured, delay_samples = rig.controller.position == "measured", rig.loop.delay_samples
    if not isinstance(rig.observer, Custom):
        own = rig.observer.predictor(observer, rig.observer_context, delay_samples, measured=measured)
        if own is not None:
            return own
    return LinearPredictor(rig.model.values(), rig.period, rig.loop.delay_samples, measured=measured)


def make_supervisor(
    rig: Rig,
    notify: Callable[[Event], None],
    first: Sequence[Check] = (),
    chatter: Chatter | None = None,
) -> Supervisor:
    """Make the supervisor with the checks that `[supervisor]` asks for, behind those that come first."""
    chatter = chatter or make_chatter(rig)
    limits = rig.supervisor
    limiter = make_limiter(rig, notify)
    checks: list[Check] = [*first, FiniteMonitor()]
    if limits.monitors == "all":
        setting = rig.observer_context
        watch = SuperTwisting(setting, mu0=watch_floor(setting.counts_per_rev, setting.period))
        position, velocity = limits.position_limit_rad, limits.velocity_limit_rad_s
        spare = resolution(rig.encoder.count, rig.period)
        independent = RangeMonitor(position, velocity, spare, WATCHING_OBSERVER)
        second = DisturbanceWatch(watch, setting, limits.disturbance_limit_rad_s2, ranges=independent)
        chatter.samples = second.samples
        limiter.watch_variation(chatter)
        checks += [RangeMonitor(position, velocity, spare), second]
    immediate = limits.start == "immediate"
    probe = (
        None
        if immediate or limits.probe == "off"
        else probe_for(rig.model.values(), rig.amplifier.limit, rig.encoder.count, notify)
    )
    return Supervisor(
        checks,
        limiter,
        settle=0.0 if immediate else _SETTLING_TIME_S,
        engage=0.0 if immediate else _ENGAGING_TIME_S,
        notify=notify,
        probe=probe,
    )


def make_chatter(rig: Rig) -> Chatter:
    """Make what judges the variation of the voltage by what the rig explains of it."""
    return Chatter(expected_variation(rig), rig.period, rig.encoder.count)


def make_limiter(rig: Rig, notify: Callable[[Event], None]) -> Limiter:
    """Make the clamps on what the loop asks for; with `monitors = "finite"` the voltage's alone."""
    limits, amplifier = rig.supervisor, rig.amplifier
    if limits.monitors != "all":
        return Limiter(voltage=amplifier.limit, period=rig.period, notify=notify)
    position, velocity = limits.reference_limits
    acceleration, braking = rig.reference_accelerations
    return Limiter(
        voltage=amplifier.limit,
        slew=amplifier.slew,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        braking=braking,
        strongest=rig.model.ku_rad_s2_V * amplifier.limit,
        error=limits.error_limit,
        period=rig.period,
        notify=notify,
    )


def make_outlier_filter(rig: Rig) -> OutlierFilter:
    """Make what leaves wrong counts out; with `monitors = "finite"` it leaves none out."""
    limits = rig.supervisor
    fastest = limits.velocity_limit_rad_s if limits.monitors == "all" else math.inf
    return OutlierFilter(fastest, rig.period, rig.encoder.count)
