"""From blocks and events to what Rerun is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from dcmp_hil.telemetry.link_events import in_order
from dcmp_hil.telemetry.rerun.decimation import peaks, rows_per_bucket
from dcmp_hil.telemetry.rerun.histogram import FixedRangeHistogram
from dcmp_hil.telemetry.rerun.parameter_table import PATH, RELATIVE, Parameters, line_of, table_of
from dcmp_hil.telemetry.rerun.phase_portrait import Portrait
from dcmp_hil.telemetry.rerun.scene import ARM, GHOST, HISTOGRAMS, LIMITS, LINK, lane_path, turned
from dcmp_hil.telemetry.rerun.transitions import TransitionDetector
from dcmp_hil.telemetry.signals import by_plot
from dcmp_hil.values import LinkData, PhaseData

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.rerun.rig_view import RigView
    from dcmp_hil.telemetry.signals import Signal
    from dcmp_hil.values import Event

    Call = tuple[str, list[rr.TimeColumn], rr.ComponentColumnList]

_POSE_RATE_HZ = 50
_LATE_MIN_PERIODS = 0.5  # of a period


class Frames:
    """Turns a run into calls of `send_columns`: entity, times and columns.

    Parameters
    ----------
    rig
        Its limit and its period are used.

    Attributes
    ----------
    plots
        Entity to the signals drawn there, known with the first block.
    """

    def __init__(self, rig: RigView) -> None:
        self.plots: dict[str, list[Signal]] = {}
        self._rig = rig
        self._histograms = {
            field: FixedRangeHistogram(low * rig.period, high * rig.period)
            for field, (_, low, high, _) in HISTOGRAMS.items()
        }
        self._lanes = {name: TransitionDetector() for name in ("voltage", "samples")}
        self._shown: dict[str, str] = {}  # lane to the newest state
        self._last_slot = -1
        self._portrait = Portrait()
        self._parameters = Parameters(rig.parameters, rig.kinds, rig.numbers)
        self._bucket = rows_per_bucket(rig.period)

    def choose_lines(self, block: Block) -> None:
        """Leave out the truth, or the model's share, where it is unknown, before the first line is drawn."""
        # By the position: even a simulation knows no disturbance before its first step.
        unknown = {"_true_"} if np.isnan(block["position_true"]).all() else set()
        if np.isnan(block.gravity).all():
            unknown |= {"gravity_", "friction_", "unexplained_"}
        for plot, signals in by_plot().items():
            drawn = [signal for signal in signals if not any(part in signal.column for part in unknown)]
            if drawn:
                self.plots[plot] = drawn

    def of_block(self, block: Block) -> list[Call]:
        """Return the calls for consecutive cycles, at least one."""
        calls = [*self._lines(block), *self._slow(block), *self._states(block), *self._tuned(block["t"][-1:])]
        for field, histogram in self._histograms.items():
            if histogram.add(block["t"], block[field]):
                calls.append(self._bars(field, block["t"][-1:]))
        return calls + self._phase(block)

    def of_event(self, event: Event) -> list[Call]:
        """Return the calls for an event."""
        t = np.array([event.t])
        if isinstance(event.data, PhaseData):
            return [self._state("phase", t, [event.data.phase])]
        if isinstance(event.data, LinkData):
            counts = np.array([in_order(event.data.counters)])
            return [(LINK, self._times(t), rr.Scalars.columns(scalars=counts))]
        told = rr.TextLog.columns(text=[event.text], level=[event.level])
        return [("events/log", self._times(t), told), *self._changed(event)]

    def of_once(self, t: float) -> list[Call]:
        """Return at `t` what was sent once, or when it changed: the table of parameters, states, axes."""
        at = np.array([t])
        states = [self._state(lane, at, [state]) for lane, state in self._shown.items()]
        axes = [(entity, self._times(at), columns) for entity, columns in self._portrait.axes()]
        return [*self._table(t, {}), *states, *axes]

    def of_start(self) -> list[Call]:
        """Return the calls for what the run is tuned by as it begins."""
        return self._table(0.0, dict(self._parameters.numbers()))

    def _changed(self, event: Event) -> list[Call]:
        changed = self._parameters.take(event)
        if changed is None:
            return []
        return [*self._table(event.t, changed), *self._tuned(np.array([event.t]))]

    def _table(self, t: float, numbers: dict[str, float]) -> list[Call]:
        times = self._times(np.array([t]))
        text = table_of(self._rig.name, self._parameters.rows.items())
        page = rr.TextDocument.columns(text=[text], media_type=["text/markdown"])
        lines = [(line_of(key), times, rr.Scalars.columns(scalars=[value])) for key, value in numbers.items()]
        return [(PATH, times, page), *lines]

    def _tuned(self, t: NDArray[np.float64]) -> Iterator[Call]:
        """Yield all of it over what it was at the start; a line without an end until there is a new one."""
        if self._parameters.drawn:
            yield RELATIVE, self._times(t), rr.Scalars.columns(scalars=[self._parameters.relative])

    def _lines(self, block: Block) -> Iterator[Call]:
        for plot, signals in self.plots.items():
            values = np.stack([signal.read(block) for signal in signals], axis=1)
            t, drawn = peaks(block["t"], values, self._bucket)
            yield plot, self._times(t), rr.Scalars.columns(scalars=drawn)

    def _phase(self, block: Block) -> list[Call]:
        self._portrait.add(block)
        found = self._portrait.draw()
        if found is None:
            return []
        t, calls = found
        times = self._times(np.array([t]))
        return [(entity, times, columns) for entity, columns in calls]

    def _slow(self, block: Block) -> Iterator[Call]:
        """Yield what 50 points a second are enough for: the pendulum, and the lines of the limit."""
        slots = np.floor(block["t"] * _POSE_RATE_HZ + 1e-6).astype(np.int64)
        rows = np.flatnonzero(np.diff(slots, prepend=self._last_slot))
        self._last_slot = int(slots[-1])
        if not len(rows):
            return
        times = self._times(block["t"][rows])
        true = block["position_true"]
        position = np.where(np.isnan(true), block["position"], true)
        for path, angles in ((ARM, position), (GHOST, block.reference[:, 0])):
            yield path, times, rr.Transform3D.columns(quaternion=turned(angles[rows]))
        limit = self._rig.voltage_limit
        if limit is not None:
            yield LIMITS, times, rr.Scalars.columns(scalars=np.tile([limit, -limit], (len(rows), 1)))

    def _states(self, block: Block) -> Iterator[Call]:
        limit = self._rig.voltage_limit
        questions = {
            "samples": (block["lateness"] > _LATE_MIN_PERIODS * self._rig.period, ("on time", "late"))
        }
        if limit is not None:
            at_limit = np.abs(block["voltage_sent"]) >= limit * (1.0 - 1e-9)
            questions["voltage"] = (at_limit, ("within limits", "at the limit"))
        for lane, (truth, names) in questions.items():
            rows = self._lanes[lane].changes(truth)
            if len(rows):
                yield self._state(lane, block["t"][rows], [names[int(truth[row])] for row in rows])

    def _state(self, lane: str, t: NDArray[np.float64], states: list[str]) -> Call:
        self._shown[lane] = states[-1]
        return lane_path(lane), self._times(t), rr.StateChange.columns(state=states)

    def _bars(self, field: str, t: NDArray[np.float64]) -> Call:
        shown, (entity, _, _, colour) = self._histograms[field], HISTOGRAMS[field]
        bars = rr.BarChart.columns(
            values=[shown.counts.copy()],
            abscissa=[shown.centres_us],
            widths=[shown.widths_us],
            color=[colour],
        )
        return entity, self._times(t), bars

    def _times(self, t: NDArray[np.float64]) -> list[rr.TimeColumn]:
        # Rounded: what Rerun makes of float seconds itself is cut off, and one nanosecond short.
        durations = np.rint(t * 1e9).astype("timedelta64[ns]")
        ticks = np.rint(t / self._rig.period).astype(np.int64)
        return [rr.TimeColumn("loop_time", duration=durations), rr.TimeColumn("tick", sequence=ticks)]
