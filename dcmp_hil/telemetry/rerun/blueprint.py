"""The layout of the dashboard, sent with every recording so that a viewer opens right without a click."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rerun as rr
import rerun.blueprint as rrb

from dcmp_hil.telemetry.plot_labels import title
from dcmp_hil.telemetry.rerun import phase_portrait
from dcmp_hil.telemetry.rerun.parameter_table import PATH, RELATIVE
from dcmp_hil.telemetry.rerun.scene import LINK
from dcmp_hil.telemetry.signals import by_plot

if TYPE_CHECKING:
    from dcmp_hil.telemetry.rerun.rig_view import RigView

TIMELINE = "loop_time"
_WINDOW_S = 10.0  # s on the axis of every plot
_JOINT, _VOLTAGE, _TIMING = "joint/", "control/voltage_V", "loop/timing_us"  # plots with a place of their own
_AXIS_LIMIT_RATIO = 1.3  # so that the lines of the limit show


def dashboard(rig: RigView) -> rrb.Blueprint:
    """Return the layout of the dashboard: the arm, its motion, the motor's voltage, and the loop's timing."""
    left = rrb.Vertical(_pendulum(rig), _portrait(), _parameters(), row_shares=[36, 32, 32])
    plots = {path: _plot_of(path, len(signals), rig) for path, signals in by_plot().items()}
    joint = rrb.Vertical(*(plots[path] for path in plots if path.startswith(_JOINT)))
    timing = rrb.Horizontal(plots[_TIMING], _histograms(), column_shares=[56, 44])
    others = [plots[path] for path in plots if not path.startswith(_JOINT) and path != _TIMING]
    control = rrb.Vertical(*others, timing)
    states = rrb.Horizontal(_states(), _events(), column_shares=[50, 50])
    if rig.wired:
        states = rrb.Horizontal(_states(), _link(), _events(), column_shares=[36, 24, 40])
    right = rrb.Vertical(rrb.Horizontal(joint, control), states, row_shares=[80, 20])
    return opened(rrb.Horizontal(left, right, column_shares=[24, 76]))


def opened(content: rrb.Container | rrb.View, *, follow: bool = True) -> rrb.Blueprint:
    """Show nothing but `content`, and follow the newest data unless all of it is there already."""
    return rrb.Blueprint(
        content,
        rrb.TopPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following" if follow else "paused"),
        auto_layout=False,
        auto_views=False,
    )


def plot(
    path: str,
    *,
    window: float | None = _WINDOW_S,
    legend: bool = True,
    reach: float | None = None,
    name: str = "",
    contents: str | list[str] = "$origin/**",
) -> rrb.TimeSeriesView:
    """Return the view of a plot.

    Parameters
    ----------
    path
        The entity.
    window
        s shown, up to the time cursor; None for everything.
    legend
        False where a single line needs no name.
    reach
        Fixed range of the value, either way; None fits it to what is shown.
    name
        Title; empty takes it from the path.
    contents
        Entities, where it is not the whole of `path`.
    """
    return rrb.TimeSeriesView(
        origin=path,
        contents=contents,
        name=name or title(path),
        axis_y=None if reach is None else rrb.ScalarAxis(range=(-reach, reach)),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
        time_ranges=None if window is None else [_last(window)],
    )


def _plot_of(path: str, lines: int, rig: RigView) -> rrb.TimeSeriesView:
    """Return the view of a plot of the table of signals; a single line needs no name."""
    limit = rig.voltage_limit if path == _VOLTAGE else None
    return plot(
        path,
        legend=lines > 1,
        reach=None if limit is None else _AXIS_LIMIT_RATIO * limit,
        name="Timing, worst [µs]" if path == _TIMING else "",
    )


def _last(seconds: float) -> rr.VisibleTimeRange:
    return rr.VisibleTimeRange(
        TIMELINE,
        start=rr.TimeRangeBoundary.cursor_relative(seconds=-seconds),
        end=rr.TimeRangeBoundary.cursor_relative(),
    )


def _pendulum(rig: RigView) -> rrb.Spatial3DView:
    return rrb.Spatial3DView(
        origin="rig",
        name="Pendulum (true)" if rig.simulated else "Pendulum (measured)",
        background=rrb.Background(color=(15, 17, 20)),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=(0.5, 0.25, 3.1), look_target=(0, 0, 0), eye_up=(0, 1, 0)
        ),
    )


def _portrait() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=phase_portrait.PATH,
        name="Phase portrait",
        background=rrb.Background(color=(15, 17, 20)),
        visual_bounds=rrb.VisualBounds2D(x_range=(-1.5, 1.5), y_range=(-1.45, 1.45)),
    )


def _link() -> rrb.TimeSeriesView:
    return plot(LINK, window=None, name="Link: lost, damaged", legend=False)


def _parameters() -> rrb.Tabs:
    return rrb.Tabs(
        rrb.TextDocumentView(origin=PATH, contents=["$origin"], name="Parameters"),
        plot(RELATIVE, window=None, name="Changes [of the value at the start]"),
        rrb.TextDocumentView(origin="about", name="Versions and host"),
        active_tab=0,
    )


def _histograms() -> rrb.Tabs:
    legend = rrb.PlotLegend(rrb.Corner2D.RightTop, visible=False)
    views = [
        rrb.BarChartView(origin=f"loop/{what}_hist", name=name, plot_legend=legend)
        for what, name in (
            ("period", "All periods [µs]"),
            ("lateness", "All lateness [µs]"),
            ("compute", "Sample to command [µs]"),
        )
    ]
    return rrb.Tabs(*views, active_tab=0)


def _states() -> rrb.StateTimelineView:
    return rrb.StateTimelineView(origin="events", name="Phase and states")


def _events() -> rrb.TextLogView:
    columns = rrb.TextLogColumns(text_log_columns=["loglevel", "body"])
    return rrb.TextLogView(origin="events", name="Events", columns=columns)
