"""The layout of the dashboard, sent with every recording so that a viewer opens right without a click."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import rerun as rr
import rerun.blueprint as rrb

from dcmp_hil.telemetry.plot_labels import title
from dcmp_hil.telemetry.rerun import banner, phase_portrait
from dcmp_hil.telemetry.rerun.histogram import HISTOGRAMS
from dcmp_hil.telemetry.rerun.link_columns import LINK
from dcmp_hil.telemetry.rerun.parameter_table import PATH, RELATIVE
from dcmp_hil.telemetry.rerun.plots import DISTURBANCE_ERRORS, TIMING, plots
from dcmp_hil.telemetry.rerun.rails import WINDOW_S
from dcmp_hil.telemetry.rerun.scene import LOG, lanes_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from dcmp_hil.telemetry.rerun.rig_view import RigView

TIMELINE = "loop_time"
_FUTURE_S = 1.5  # s on the right of the cursor, where no data are: the legend stands there
_LINK_TIME_S = 60.0  # s of the link's counters, and as much room for the names of the lines
_LEFT_SHARE = 17  # % of the width: what is left is 75 pixels a second on a screen of 1366
_BACKGROUND_RGB = (15, 17, 20)
_TRIPPED_RGB = (42, 6, 8)
_LOG_COLUMNS = rrb.TextLogColumns(text_log_columns=["loglevel", "body"])


def dashboard(rig: RigView, *, tripped: bool = False) -> rrb.Blueprint:
    """Return the layout of the dashboard: the arm, what happens, how wrong it is, and states.

    Parameters
    ----------
    rig
        What is shown of it.
    tripped
        Whether the run ended by a trip: plots are red, and the banner has room for cause and cure.
    """
    left = rrb.Vertical(_pendulum(rig), _portrait(), _parameters(), row_shares=[36, 32, 32])
    all_of_them = plots(rig.further)
    shown = [plot for plot in all_of_them if plot.path != DISTURBANCE_ERRORS or _knows_disturbance(rig)]
    views = {plot.path: _scrolling(plot.path, plot.titled, tripped=tripped) for plot in shown}
    beside: dict[str, list[rrb.View]] = {}
    for plot in shown:
        if plot.beside:
            beside.setdefault(plot.beside, []).append(views[plot.path])
    own = [plot for plot in shown if not plot.beside]
    happens = rrb.Vertical(*(_tabbed(views[one.path], beside, one.path) for one in own if not one.wrong))
    wrong = [_tabbed(views[one.path], beside, one.path) for one in own if one.wrong and one.path != TIMING]
    timing = rrb.Tabs(*beside.get(TIMING, ()), views[TIMING], *_histograms(), active_tab=0)
    states = rrb.Horizontal(_states(rig), _events(), column_shares=[50, 50])
    if rig.wired:
        states = rrb.Horizontal(_states(rig), _link(), _events(), column_shares=[36, 24, 40])
    right = rrb.Vertical(
        _banner(),
        rrb.Horizontal(happens, rrb.Vertical(*wrong, timing)),
        states,
        row_shares=[16, 69, 15] if tripped else [8, 77, 15],
    )
    return opened(rrb.Horizontal(left, right, column_shares=[_LEFT_SHARE, 100 - _LEFT_SHARE]))


def _tabbed(
    view: rrb.TimeSeriesView, beside: Mapping[str, Sequence[rrb.View]], path: str
) -> rrb.View | rrb.Tabs:
    """Return the view of a plot, with tabs where others stand beside it: a fifth row would be too low."""
    return rrb.Tabs(view, *beside[path], active_tab=0) if path in beside else view


def opened(content: rrb.Container | rrb.View, *, follow: bool = True) -> rrb.Blueprint:
    """Show nothing but `content`, and follow the newest data unless all of it is there already."""
    return rrb.Blueprint(
        content,
        rrb.TopPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following" if follow else "paused"),
        auto_layout=False,
        auto_views=False,
    )


def plot(path: str, *, name: str = "", legend: bool = True) -> rrb.TimeSeriesView:
    """Return the view of a plot that shows all of its data.

    Parameters
    ----------
    path
        The entity.
    name
        Title; empty takes it from the path.
    legend
        False where a single line needs no name.
    """
    return rrb.TimeSeriesView(
        origin=path,
        name=name or title(path),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
    )


def _scrolling(
    path: str, name: str, *, tripped: bool, past: float = WINDOW_S, future: float = _FUTURE_S
) -> rrb.TimeSeriesView:
    """Return the view of a plot that scrolls with the cursor, its legend in the empty future."""
    background = rrb.archetypes.PlotBackground(color=_TRIPPED_RGB, show_grid=True) if tripped else None
    return rrb.TimeSeriesView(
        origin=path,
        name=name,
        axis_x=_axis(past, future),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=True),
        background=background,
        time_ranges=[_last(past)],
    )


def _axis(past: float = WINDOW_S, future: float = _FUTURE_S) -> rrb.archetypes.TimeAxis:
    return rrb.archetypes.TimeAxis(
        view_range=rr.TimeRange(
            start=rr.TimeRangeBoundary.cursor_relative(seconds=-past),
            end=rr.TimeRangeBoundary.cursor_relative(seconds=future),
        )
    )


def _last(past: float) -> rr.VisibleTimeRange:
    return rr.VisibleTimeRange(
        TIMELINE,
        start=rr.TimeRangeBoundary.cursor_relative(seconds=-past),
        end=rr.TimeRangeBoundary.cursor_relative(),
    )


def _knows_disturbance(rig: RigView) -> bool:
    return rig.simulated or math.isfinite(rig.model.gravity)


def _banner() -> rrb.Horizontal:
    lamp = rrb.Spatial2DView(
        origin=banner.LAMP,
        name="Lamp",
        titlebar=False,
        background=rrb.Background(color=_BACKGROUND_RGB),
        visual_bounds=rrb.VisualBounds2D(x_range=(-1, 1), y_range=(-1, 1)),
    )
    words = rrb.TextDocumentView(origin=banner.PATH, contents=["$origin"], name="State", titlebar=False)
    return rrb.Horizontal(lamp, words, column_shares=[3, 97])


def _pendulum(rig: RigView) -> rrb.Spatial3DView:
    return rrb.Spatial3DView(
        origin="rig",
        name="Pendulum (true)" if rig.simulated else "Pendulum (measured)",
        background=rrb.Background(color=_BACKGROUND_RGB),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=(0.55, 0.28, 3.6), look_target=(0, 0, 0), eye_up=(0, 1, 0)
        ),
    )


def _portrait() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=phase_portrait.PATH,
        name="Phase portrait",
        background=rrb.Background(color=_BACKGROUND_RGB),
        visual_bounds=rrb.VisualBounds2D(x_range=(-1.5, 1.5), y_range=(-1.45, 1.45)),
    )


def _link() -> rrb.TimeSeriesView:
    return _scrolling(LINK, "Link, last minute", tripped=False, past=_LINK_TIME_S, future=_LINK_TIME_S)


def _parameters() -> rrb.Tabs:
    return rrb.Tabs(
        rrb.TextDocumentView(origin=PATH, contents=["$origin"], name="Parameters"),
        plot(RELATIVE, name="Changes [of the value at the start]"),
        rrb.TextDocumentView(origin="about", name="Versions and host"),
        rrb.TextLogView(origin=LOG, contents=["$origin"], name="All events", columns=_LOG_COLUMNS),
        active_tab=0,
    )


def _histograms() -> list[rrb.BarChartView]:
    legend = rrb.PlotLegend(rrb.Corner2D.RightTop, visible=False)
    return [rrb.BarChartView(origin=one.entity, name=one.name, plot_legend=legend) for one in HISTOGRAMS]


def _states(rig: RigView) -> rrb.StateTimelineView:
    return rrb.StateTimelineView(
        origin="/",
        contents=[f"+ /{lane}" for lane in lanes_of(rig)],
        name="Phase and states",
        titlebar=False,
        time_view=_axis(),
    )


def _events() -> rrb.TextDocumentView:
    """Return the last events, which wrap, and of which the newest is always in sight."""
    return rrb.TextDocumentView(origin=banner.LAST, contents=["$origin"], name="Events", titlebar=False)
