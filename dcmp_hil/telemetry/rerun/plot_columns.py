"""Lines, rails and marks of every plot, as columns for Rerun."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import rerun as rr

from dcmp_hil.telemetry.rerun.decimation import peaks, rows_per_bucket, single
from dcmp_hil.telemetry.rerun.marks import MARKS, Marks, is_trip, mark_of
from dcmp_hil.telemetry.rerun.plots import VOLTAGE, Known, Line, Plot, known_of, plots
from dcmp_hil.telemetry.rerun.rails import Rails
from dcmp_hil.telemetry.signals import ESTIMATE_RGB, REFERENCE_RGB, TRUE_RGB

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.rerun.rig_view import RigView
    from dcmp_hil.values import Event

    Rows = tuple[str, NDArray[np.float64], rr.ComponentColumnList | rr.SeriesLines]
    """Entity; times, s; columns, or a look, which holds at all times."""

_WIDTHS_POINTS = {TRUE_RGB: 3.5, ESTIMATE_RGB: 1.6, REFERENCE_RGB: 1.2}
_WIDTH_POINTS = 1.4  # of every other line
_CLIP_RATIO = 1.2  # times the voltage limit, beyond which a demand is not drawn: it would flatten the rest
_CUT_TIME_S = 1e-6  # s behind a mark, where a value that is none cuts its line
_ALWAYS = np.empty(0)


@dataclass(frozen=True, slots=True)
class DrawnPlot:
    """A plot with the lines that are drawn in this run."""

    plot: Plot
    lines: tuple[Line, ...]
    rails: Rails


class PlotColumns:
    """Turns blocks and events into what the plots show.

    Parameters
    ----------
    rig
        Its voltage limit and its period are used.
    """

    def __init__(self, rig: RigView) -> None:
        self._limit = rig.voltage_limit
        self._bucket = rows_per_bucket(rig.period)
        self._drawn: list[DrawnPlot] = []
        self._marks = Marks()
        self._styled: set[str] = set()  # entities of marks whose look was sent
        self._now = self._tripped = np.inf  # s

    def of_block(self, block: Block) -> Iterator[Rows]:
        """Yield the rows for consecutive cycles, at least one and not more than about a second."""
        if not self._drawn:
            self._drawn = self._choose(known_of(block), block.further)
            for drawn in self._drawn:
                yield from _styles(drawn)
        every = block["t"]
        self._now = float(every[-1])
        self._marks.forget(float(every[0]))
        for drawn in self._drawn:
            t, values = peaks(every, self._values(drawn, block), self._bucket)
            values = single(values)
            yield f"{drawn.plot.path}/lines", t, rr.Scalars.columns(scalars=values)
            times, ends = drawn.rails.add(t, values)
            yield from _rails(drawn, times, ends)
            yield from self._due_marks(drawn)

    def of_event(self, event: Event) -> Iterator[Rows]:
        """Yield the mark of an event in every plot that has data at its time; later data bring the rest."""
        kind = mark_of(event)
        if kind is None:
            return
        self._marks.add(kind, event.t)
        if is_trip(event) and event.t < self._tripped:
            self._tripped = event.t
        for drawn in self._drawn:
            if is_trip(event) and not drawn.rails.coarse:  # the tripped layout has lower plots
                drawn.rails.coarse = True
                yield from _rails(drawn, np.array([event.t]), np.array([drawn.rails.reach(event.t)]))
            yield from self._due_marks(drawn)

    def _choose(self, known: Known, further: tuple[str, ...]) -> list[DrawnPlot]:
        """Leave out what is unknown of the plant, before the first line is drawn."""
        found = []
        for plot in plots(further):
            lines = tuple(line for line in plot.lines if line.drawn(known))
            if lines:
                least = self._limit if plot.path == VOLTAGE and self._limit is not None else 0.0
                found.append(DrawnPlot(plot, lines, Rails(least)))
        return found

    def _values(self, drawn: DrawnPlot, block: Block) -> NDArray[np.float64]:
        """Return what is drawn, shape (n, lines); what is no number, or infinite, is a gap."""
        values = np.stack([line.read(block) for line in drawn.lines], axis=1)
        if self._limit is not None:
            most = _CLIP_RATIO * self._limit
            for column, line in enumerate(drawn.lines):
                if line.clipped:
                    values[:, column] = np.clip(values[:, column], -most, most)
        if drawn.plot.frozen:
            values[block["t"] >= self._tripped] = np.nan
        values[~np.isfinite(values)] = np.nan  # no axis ends there
        return values

    def of_end(self) -> Iterator[Rows]:
        """Yield the marks that still wait for data at their time, as of a cycle that was not recorded."""
        for drawn in self._drawn:
            yield from self._due_marks(drawn, all_of_them=True)

    def _due_marks(self, drawn: DrawnPlot, *, all_of_them: bool = False) -> Iterator[Rows]:
        if not self._marks:
            return
        axis = drawn.rails.reach(self._now)
        now = np.inf if all_of_them else self._now
        for kind, at, reach in self._marks.due(drawn.plot.path, now, axis):
            entity = f"{drawn.plot.path}/marks/{kind}"
            if entity not in self._styled:
                self._styled.add(entity)
                yield entity, _ALWAYS, _look([kind], [MARKS[kind].colour], [MARKS[kind].width], "Off")
            times = np.array([at, at, at + _CUT_TIME_S])
            yield entity, times, rr.Scalars.columns(scalars=[-reach, reach, np.nan])


def _rails(drawn: DrawnPlot, times: NDArray[np.float64], ends: NDArray[np.float64]) -> Iterator[Rows]:
    if len(times):
        both = np.stack([ends, -ends], axis=1)
        yield f"{drawn.plot.path}/rails", times, rr.Scalars.columns(scalars=both)


def _styles(drawn: DrawnPlot) -> Iterator[Rows]:
    """Yield how the lines of a plot look."""
    path, lines = drawn.plot.path, drawn.lines
    # The default averages what falls on one pixel, and hides the spikes that matter here.
    policy: Literal["Max", "MinMax"] = "Max" if path.startswith("loop/") else "MinMax"
    widths = [_WIDTHS_POINTS.get(line.colour, _WIDTH_POINTS) for line in lines]
    held = path.endswith("_V")
    names, colours = [line.label for line in lines], [line.colour for line in lines]
    yield f"{path}/lines", _ALWAYS, _look(names, colours, widths, policy, held=held)
    yield f"{path}/rails", _ALWAYS, _look(["", ""], [(0, 0, 0, 0)] * 2, [0.5, 0.5], "Off")


def _look(
    names: list[str],
    colours: Sequence[Sequence[int]],
    widths: list[float],
    policy: Literal["Max", "MinMax", "Off"],
    *,
    held: bool = False,
) -> rr.SeriesLines:
    return rr.SeriesLines(
        names=names,
        colors=colours,
        widths=widths,
        aggregation_policy=policy,
        interpolation_mode="StepAfter" if held else "Linear",
    )
