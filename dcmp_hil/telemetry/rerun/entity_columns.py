"""From blocks and events to what Rerun is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from dcmp_hil.telemetry.friction_findings import DISTRUST, ModelHold
from dcmp_hil.telemetry.rerun import banner
from dcmp_hil.telemetry.rerun.histogram import HISTOGRAMS, FixedRangeHistogram, Histogram
from dcmp_hil.telemetry.rerun.link_columns import LinkColumns
from dcmp_hil.telemetry.rerun.parameter_table import PATH, RELATIVE, Parameters, line_of, page_of
from dcmp_hil.telemetry.rerun.phase_portrait import Portrait
from dcmp_hil.telemetry.rerun.plot_columns import PlotColumns
from dcmp_hil.telemetry.rerun.scene import (
    ARM,
    GHOST,
    LIMITS,
    LOG,
    MODEL_LANE,
    MODEL_STATES,
    lane_path,
    turned,
)
from dcmp_hil.telemetry.rerun.transitions import TransitionDetector
from dcmp_hil.values import LinkData, PhaseData

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.rerun.plot_columns import Rows
    from dcmp_hil.telemetry.rerun.rig_view import RigView
    from dcmp_hil.values import Event

    Call = tuple[str, list[rr.TimeColumn], rr.ComponentColumnList | rr.SeriesLines]

_POSE_RATE_HZ = 50
_SLOW_RATE_HZ = 1  # of lines that hardly change: a chunk costs 1.6 kB
_EPILOGUE_TIME_S = 1.0  # s behind a trip that the picture goes on, so that its red lane has a width
_LATE_MIN_PERIODS = 0.5  # of a period
_LAMP_RADIUS = 1000.0  # of the view's own units: it fills a view of any shape


class Frames:
    """Turns a run into calls of `send_columns`: entity, times and columns.

    Parameters
    ----------
    rig
        Its limit and its period are used.
    """

    def __init__(self, rig: RigView) -> None:
        self._rig = rig
        self._plots, self._link = PlotColumns(rig), LinkColumns()
        self._banner = banner.Banner()
        self._lamp: tuple[int, int, int] | None = None  # as it was sent
        self._said = self._banner.text(0.0)  # as it was sent
        self._histograms = [
            (one, FixedRangeHistogram(one.low * rig.period, one.high * rig.period)) for one in HISTOGRAMS
        ]
        self._lanes = {name: TransitionDetector() for name in ("voltage", "samples", MODEL_LANE)}
        self._hold = ModelHold()
        self._shown: dict[str, str] = {}  # lane to the newest state
        self._punctual = np.empty(0)  # s, the first sample, unless it was late
        self._last_pose = self._last_second = -1  # slots of their rates
        self._now = 0.0  # s, of the newest data
        self._portrait = Portrait()
        self._parameters = Parameters(rig.parameters, rig.kinds, rig.numbers)

    @property
    def tripped(self) -> bool:
        """Whether an event has told of a trip."""
        return self._banner.tripped

    @np.errstate(over="ignore", invalid="ignore")  # a class of the user's own may give any number
    def of_block(self, block: Block) -> list[Call]:
        """Return the calls for consecutive cycles, at least one and not more than about a second."""
        self._now = float(block["t"][-1])
        calls = [*self._timed(self._plots.of_block(block)), *self._poses(block), *self._states(block)]
        calls += [*self._slow(block["t"]), *self._lamp_at(self._now), *self._faded(self._now)]
        for one, histogram in self._histograms:
            if histogram.add(block["t"], block[one.field]):
                calls.append(self._bars(one, histogram, block["t"][-1:]))
        return calls + self._phase(block)

    def of_event(self, event: Event) -> list[Call]:
        """Return the calls for an event."""
        t = np.array([event.t])
        if isinstance(event.data, LinkData):
            return list(self._timed(self._link.of_counters(event.t, event.data.counters)))
        before = dict(self._parameters.rows)
        if isinstance(event.data, PhaseData):
            calls = [self._state("phase", t, [event.data.phase])]
        else:
            told = rr.TextLog.columns(text=[event.text], level=[event.level])
            calls = [(LOG, self._times(t), told), *self._changed(event)]
        self._banner.take(event, before, self._parameters.rows)
        if self.tripped:
            self._now = max(self._now, event.t)
        return [*calls, *self._words(event.t), *self._timed(self._plots.of_event(event))]

    def of_once(self, t: float) -> list[Call]:
        """Return at `t` what was sent once, or when it changed: parameters, states, banner, axes."""
        at = np.array([t])
        states = [self._state(lane, at, [state]) for lane, state in self._shown.items()]
        axes = [(entity, self._times(at), columns) for entity, columns in self._portrait.axes()]
        self._lamp = None
        return [*self._table(t, {}), *self._words(t), *states, *axes]

    def of_end(self) -> list[Call]:
        """Return the calls behind the last block: lines that are sent seldom end there, a trip lasts 1 s."""
        calls = [*self._seldom(np.array([self._now])), *self._timed(self._plots.of_end())]
        if self.tripped and "phase" in self._shown:
            at = np.array([self._now + _EPILOGUE_TIME_S])
            calls.append(self._state("phase", at, [self._shown["phase"]]))
        return calls

    def of_start(self) -> list[Call]:
        """Return the calls for what the run is tuned by as it begins."""
        return [*self._table(0.0, dict(self._parameters.numbers())), *self._words(0.0)]

    def _words(self, t: float) -> list[Call]:
        """Return banner, lamp and the last events, as they are now."""
        times = self._times(np.array([t]))
        self._said = self._banner.text(t)
        pages = ((banner.PATH, self._said), (banner.LAST, self._banner.last))
        return [
            *((path, times, _page(text)) for path, text in pages),
            *self._lamp_at(t),
        ]

    def _lamp_at(self, t: float) -> Iterator[Call]:
        """Yield the lamp where its colour is another than before."""
        colour = self._banner.colour(t)
        if colour != self._lamp:
            self._lamp = colour
            strip = np.array([[-1.0, 0.0], [1.0, 0.0]])
            lamp = rr.LineStrips2D.columns(strips=[strip], colors=[colour], radii=[_LAMP_RADIUS])
            yield banner.LAMP, self._times(np.array([t])), lamp

    def _faded(self, t: float) -> Iterator[Call]:
        """Yield the banner where a warning has left it."""
        if self._banner.text(t) != self._said:
            self._said = self._banner.text(t)
            yield banner.PATH, self._times(np.array([t])), _page(self._said)

    def _timed(self, rows: Iterable[Rows]) -> Iterator[Call]:
        last: NDArray[np.float64] | None = None
        times: list[rr.TimeColumn] = []
        for entity, t, columns in rows:
            if t is not last:  # the plots have the same times: a tenth of a block's cost
                last, times = t, self._times(t)
            yield entity, times, columns

    def _changed(self, event: Event) -> list[Call]:
        changed = self._parameters.take(event)
        if changed is None:
            return []
        return [*self._table(event.t, changed), *self._tuned(np.array([event.t]))]

    def _table(self, t: float, numbers: dict[str, float]) -> list[Call]:
        times = self._times(np.array([t]))
        text = page_of(self._rig.name, self._parameters.rows)
        lines = [(line_of(key), times, rr.Scalars.columns(scalars=[value])) for key, value in numbers.items()]
        return [(PATH, times, _page(text)), *lines]

    def _tuned(self, t: NDArray[np.float64]) -> Iterator[Call]:
        """Yield all of it over what it was at the start; a line without an end until there is a new one."""
        if self._parameters.drawn:
            yield RELATIVE, self._times(t), rr.Scalars.columns(scalars=[self._parameters.relative])

    def _phase(self, block: Block) -> list[Call]:
        if not self.tripped:  # a bad count in the last cycle would set its axes
            self._portrait.add(block)
        found = self._portrait.draw()
        if found is None:
            return []
        t, calls = found
        times = self._times(np.array([t]))
        return [(entity, times, columns) for entity, columns in calls]

    def _poses(self, block: Block) -> Iterator[Call]:
        """Yield the pendulum, for which 50 points a second are enough."""
        slots = np.floor(block["t"] * _POSE_RATE_HZ + 1e-6).astype(np.int64)
        rows = np.flatnonzero(np.diff(slots, prepend=self._last_pose))
        self._last_pose = int(slots[-1])
        if not len(rows):
            return
        times = self._times(block["t"][rows])
        true = block["position_true"]
        position = np.where(np.isnan(true), block["position"], true)
        for path, angles in ((ARM, position), (GHOST, block.reference[:, 0])):
            yield path, times, rr.Transform3D.columns(quaternion=turned(angles[rows]))

    def _slow(self, t: NDArray[np.float64]) -> Iterator[Call]:
        """Yield once a second what hardly changes."""
        slots = np.floor(t * _SLOW_RATE_HZ + 1e-6).astype(np.int64)
        rows = np.flatnonzero(np.diff(slots, prepend=self._last_second))
        self._last_second = int(slots[-1])
        if len(rows):
            yield from self._seldom(t[rows])

    def _seldom(self, t: NDArray[np.float64]) -> Iterator[Call]:
        """Yield the lines of the limit, and the parameters over what they were at the start."""
        limit = self._rig.voltage_limit
        if limit is not None:
            yield LIMITS, self._times(t), rr.Scalars.columns(scalars=np.tile([limit, -limit], (len(t), 1)))
        yield from self._tuned(t[-1:])

    def _states(self, block: Block) -> Iterator[Call]:
        limit = self._rig.voltage_limit
        questions = {
            "samples": (block["lateness"] > _LATE_MIN_PERIODS * self._rig.period, ("on time", "late"))
        }
        if limit is not None:
            at_limit = np.abs(block["voltage_sent"]) >= limit * (1.0 - 1e-9)
            questions["voltage"] = (at_limit, ("within limits", "at the limit"))
        if DISTRUST in block.further:
            holds, let_go = MODEL_STATES
            questions[MODEL_LANE] = (self._hold.of(block[DISTRUST]), (holds, let_go))
        for lane, (truth, names) in questions.items():
            rows = self._lanes[lane].changes(truth)
            if len(rows):
                times = block["t"][rows]
                yield from self._seen(lane, times, [names[int(truth[row])] for row in rows])

    def _seen(self, lane: str, t: NDArray[np.float64], states: list[str]) -> Iterator[Call]:
        """Yield new states; the lane of samples is not there, and takes no room, until one is late."""
        if lane == "samples" and lane not in self._shown:
            t, states = np.concatenate((self._punctual, t)), ["on time"] * len(self._punctual) + states
            self._punctual = t[:1]
            if states == ["on time"]:
                return
        yield self._state(lane, t, states)

    def _state(self, lane: str, t: NDArray[np.float64], states: list[str]) -> Call:
        self._shown[lane] = states[-1]
        return lane_path(lane), self._times(t), rr.StateChange.columns(state=states)

    def _bars(self, one: Histogram, shown: FixedRangeHistogram, t: NDArray[np.float64]) -> Call:
        bars = rr.BarChart.columns(
            values=[shown.counts.copy()],
            abscissa=[shown.centres_us],
            widths=[shown.widths_us],
            color=[one.colour],
        )
        return one.entity, self._times(t), bars

    def _times(self, t: NDArray[np.float64]) -> list[rr.TimeColumn]:
        # Rounded: what Rerun makes of float seconds itself is cut off, and one nanosecond short.
        return [rr.TimeColumn("loop_time", duration=np.rint(t * 1e9).astype("timedelta64[ns]"))]


def _page(text: str) -> rr.ComponentColumnList:
    return rr.TextDocument.columns(text=[text], media_type=["text/markdown"])
