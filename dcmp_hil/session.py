"""A run: builds the loop, runs it, ends it at 0 V, and keeps the figures."""

from __future__ import annotations

import math
import pickle
from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING

from dcmp_hil.assembly import assemble, make_laws
from dcmp_hil.config.compared_observers import observer_kinds
from dcmp_hil.config.run_times import check_times
from dcmp_hil.errors import DeadlineError, TripError
from dcmp_hil.fault_hooks import inject
from dcmp_hil.ipc.run_end import NOT_OURS, ZERO, end_after
from dcmp_hil.live.live_changes import LiveChanges
from dcmp_hil.platform.clock import MonotonicClock, SimulatedClock
from dcmp_hil.platform.host_info import host_facts, in_words, require_linux
from dcmp_hil.platform.realtime import RealTime
from dcmp_hil.platform.stop_request import StopRequest
from dcmp_hil.result import Result
from dcmp_hil.run_engine import fastest_drive, loop_drive, run_to_end
from dcmp_hil.telemetry.memory_sink import MemorySink
from dcmp_hil.telemetry.sink_factories import begin_all, deferred, sorted_out
from dcmp_hil.telemetry.statistics import Statistics
from dcmp_hil.telemetry.summary_sink import SummarySink
from dcmp_hil.telemetry.telemetry_process import TelemetryProcess
from dcmp_hil.values import CauseData, Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.device.disarm import DeviceEnd
    from dcmp_hil.fault_hooks import Faults
    from dcmp_hil.ipc.run_end import RunEnd
    from dcmp_hil.live import CommandInterface
    from dcmp_hil.telemetry.dispatcher import Sink
    from dcmp_hil.telemetry.sink_factories import SinkMaker
    from dcmp_hil.values import EventData, Level

_END_TIME_S = 10.0
"""s in which a second Ctrl-C interrupts nothing of the end: what it takes when nothing hangs is below 3 s."""


class Session:
    """A run that can be asked for its result however it ended.

    Parameters
    ----------
    rig
        What to run.
    duration
        s; None takes `run.duration_s`; 0 is until stopped.
    fast
        Virtual time, as fast as the arithmetic; only the simulated rig can.
    window_from
        s, device time from which the figures count.
    sinks
        Further sinks of the run, or functions that make one. In real time a function that can be pickled is
        called in the telemetry process, and its sink shares nothing with the loop; every other sink runs on a
        thread of this process, which costs the loop its punctuality.
    keep_columns
        False for long runs: memory then stays bounded.
    stop
        Asked once a cycle; its own unless the caller listens for signals already.
    warn
        Told, in a sentence, what of telemetry the run goes on without.
    control
        The interface through which the run may be changed while it goes on; None for no changes.
    faults
        What goes wrong on purpose, as for `run`; or faults that are prepared for this rig already.
    clear
        Whether a fault that waits for a person is cleared: STOP by a person, the amplifier's own protection,
        what the board found wrong with itself. Set it when a person has looked, never by default.
    compare
        Kinds of observers that run beside the loop, on the same samples; a text may be a list of them.
    plain
        Whether the loop of the host runs in virtual time also where the core could.

    Raises
    ------
    ConfigError
        If an argument does not fit the rig.
    """

    def __init__(  # noqa: PLR0913 - each is a choice of its own
        self,
        rig: Rig,
        *,
        duration: float | None = None,
        fast: bool = False,
        window_from: float = 0.0,
        sinks: Sequence[Sink | SinkMaker] = (),
        keep_columns: bool = True,
        stop: StopRequest | None = None,
        warn: Callable[[str], None] | None = None,
        control: CommandInterface | None = None,
        faults: Iterable[object] | Faults = (),
        clear: bool = False,
        compare: Sequence[str] = (),
        plain: bool = False,
    ) -> None:
        length = rig.run.duration_s if duration is None else duration
        check_times(length, window_from, fast=fast)
        if not fast:
            require_linux("a run in real time")
        self.rig = rig
        self._length = length or math.inf
        self._wall = MonotonicClock()
        clock = SimulatedClock() if fast else self._wall
        self.stop = stop or StopRequest()
        self._realtime = None if fast else RealTime(rig.timing)
        self._host = host_facts()
        statistics = Statistics(rig.period, window_from)
        laws = make_laws(rig, compare)
        self._compared = observer_kinds(compare)
        self._apart: TelemetryProcess | None = None
        self._figures = SummarySink(statistics, MemorySink() if keep_columns else None)
        if fast:
            here = [self._figures, *deferred(sinks)]
        else:
            here, there = sorted_out(sinks)
            model = rig.model.values()
            self._apart = TelemetryProcess(
                statistics,
                keep=keep_columns,
                sinks=there,
                warn=warn,
                model=model,
                unattended=pickle.dumps(control.unattended) if control else b"",
                mailbox=control.file if control else None,
                further=laws.further.names,
            )
        self._control, mailbox = control, control.mailbox if control else None
        self._stages, self._recorder = assemble(
            rig,
            clock,
            here,
            in_line=fast,
            apart=self._apart,
            mailbox=mailbox,
            stop=self.stop,
            clear=clear,
            faults=inject(rig, faults) if isinstance(faults, Iterable) else faults,
            laws=laws,
        )
        self._sinks = here
        self._drive = (
            fastest_drive(rig, self._stages, self._recorder, looked_at=bool(sinks))
            if fast and not plain
            else loop_drive(self._stages)
        )
        self._realtime_factor = math.nan

    def run(self) -> None:
        """Run to the end; after every kind of end the amplifier is at 0 V and the sinks are closed.

        Raises
        ------
        TripError
            With the last second of cycles.
        DeadlineError
            If `timing` enforces real time that is not granted, or ends a run that is late too often.
        BackendError
            If the device or the way to it fails.
        """
        with self.stop:
            self._run()

    def _run(self) -> None:
        stages, recorder = self._stages, self._recorder
        began_ns, end, why, reached, armed = self._wall.now_ns(), ZERO, "", False, False
        try:
            # The backend last: collecting garbage with an armed device would cost it its watchdog.
            with self._open_telemetry(), self._realtime or nullcontext():
                self._say_where()
                if self.stop.requested:  # while telemetry came up
                    end = NOT_OURS
                    return
                began_ns, reached = self._wall.now_ns(), True
                with self.stop.held_behind(_END_TIME_S), stages.backend:
                    armed = True
                    self._run_loop()
        except TripError as seen:
            trip = seen.explained()  # milliseconds, and the device is at 0 V and disarmed
            recorder.fill(trip)
            end, why = end_after(trip, reached=reached, armed=armed), f"{trip} "
            self._tell("ERROR", EventKind.TRIP, f"tripped ({trip.reason}): {trip}", CauseData(trip.reason))
            raise trip from seen.__cause__
        except DeadlineError as error:
            if recorder.began:  # refused before it began, it is no event of the run
                self._tell("ERROR", EventKind.DEADLINE, f"deadline: {error}", CauseData("deadline"))
            end, why = end_after(error, reached=reached, armed=armed), f"{error} "
            raise
        except BaseException as error:
            end, why = end_after(error, reached=reached, armed=armed), f"{error} "
            raise
        finally:
            try:
                self.stop.hold(_END_TIME_S)
            finally:  # also where a second Ctrl-C comes just before
                self._finish(end, why, began_ns)

    def _finish(self, end: RunEnd, why: str, began_ns: int) -> None:
        """Report the end, and close what the run was kept in, also where something else fails."""
        self.stop.hold(_END_TIME_S)
        recorder = self._recorder
        try:
            if self._control:
                self.stop.wake_no_more()
                self._control.close(f"{why}{end.sentence}", end.code)
            wall = 1e-9 * (self._wall.now_ns() - began_ns)
            self._realtime_factor = recorder.t / wall if wall > 0 else math.nan
            recorder.tell_rest()
            ended: DeviceEnd | None = getattr(self._stages.backend, "device_end", None)
            if not why and ended and ended.fault:
                self._tell("WARN", EventKind.DEVICE_END, ended.warning)
            self._tell(end.level, EventKind.END, end.words, end.forced)
        finally:
            recorder.close()
            if self._apart:
                self._figures = self._apart.figures
            self.stop.hold(_END_TIME_S)  # what is kept becomes files, or is thrown away, by the caller

    def _open_telemetry(self) -> AbstractContextManager[None]:
        """Make the sinks, here and in a process of their own, before anything is armed or real-time."""
        further = self._recorder.further
        begin_all(self._sinks, further)
        if self._control:
            ring = self._apart.ring_file if self._apart else None
            self._control.open(self.rig, ring, self._warn_live, further)
            self.stop.wake(self._control.signals)
        if self._apart:
            self._apart.open(lambda: self.stop.requested)
        if self._control:
            self._control.wait_until_up(lambda: self.stop.requested)
        return nullcontext()

    def _warn_live(self, sentence: str) -> None:
        """Ask the loop to report a warning; called from another thread."""
        if isinstance(self._stages.changes, LiveChanges):
            self._stages.changes.warn(sentence)

    def _run_loop(self) -> None:
        stages, recorder = self._stages, self._recorder
        device = getattr(stages.backend, "described", "")
        if device:
            recorder.event(Event(0.0, "INFO", EventKind.DEVICE, f"device: {device}"))
        for remark in getattr(stages.backend, "remarks", ()):
            recorder.event(Event(0.0, "WARN", EventKind.DEVICE, remark))
        run_to_end(self._drive.cycles, self.rig, self._length, recorder, self.stop)

    def _tell(self, level: Level, kind: EventKind, text: str, data: EventData | None = None) -> None:
        """Report an event at the device time of the last cycle."""
        self._recorder.event(Event(self._recorder.t, level, kind, text, data))

    def _say_where(self) -> None:
        """Report the computer, and the requests that it did not grant."""
        self._recorder.event(Event(0.0, "INFO", EventKind.HOST, in_words(self._host)))
        for grant in self._realtime.grants if self._realtime else ():
            said = "granted" if grant.granted else grant.refusal
            self._recorder.event(Event(0.0, "INFO", EventKind.GRANT, f"{grant.what}: {said}"))

    @property
    def began(self) -> bool:
        """Whether there was a first period."""
        return self._recorder.began

    @property
    def telemetry_pid(self) -> int | None:
        """The telemetry process; None where there is none, or it has not come up."""
        return self._apart.pid if self._apart else None

    def result(self) -> Result:
        """Return the result so far, of a complete or an interrupted run."""
        columns = self._figures.columns()
        return Result(
            rig=self.rig,
            summary=self._figures.statistics.summary(self._realtime_factor),
            columns=columns,
            events=self._figures.events(),
            periods=self._recorder.written,
            dropped=self._apart.dropped if self._apart else self._recorder.dropped,
            link=getattr(self._stages.backend, "counters", None),
            link_concerns=tuple(self._recorder.link.concerns.values()),
            device_end=getattr(self._stages.backend, "device_end", None),
            grants=tuple(self._realtime.grants) if self._realtime else (),
            host=self._host,
            overruns=self._stages.deadline_monitor.count,
            outliers=self._drive.cycles.outliers,
            troubles=tuple(self._figures.troubles),
            changes=tuple(getattr(self._stages.changes, "made", ())),
            motor_gain=self._drive.cycles.motor_gain,
            compared=self._compared,
            last_columns=self._recorder.last_columns() if self._compared and not columns else {},
            engine=self._drive.engine,
            engine_reason=self._drive.reason,
        )
