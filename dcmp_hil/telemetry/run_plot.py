"""A picture of a whole run, for those who did not see it in a viewer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.common.atomic_file import whole_file
from dcmp_hil.common.drawing import files_only
from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.plot_labels import title
from dcmp_hil.telemetry.signals import ESTIMATE_RGB, TRUE_RGB, by_plot

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.signals import Signal

    Columns = dict[str, NDArray[np.float64]]

_POINTS_MAX = 20_000
_BUCKET_COUNT = 4_000  # each keeps its lowest and its highest point
_PLOT_COLUMNS = 2  # of plots; the first half of the table is on the left
_TEXT_COLOUR = "#4a4f57"
_START_ERROR_RATIO = 5.0  # times the largest error of the second half: a start beyond that gets no room
_DEMAND_CLIP_RATIO = 1.15  # of the largest voltage sent: a demand far beyond it would flatten all else


def draw_run(columns: dict[str, NDArray[np.float64]], title: str, path: Path) -> None:
    """Draw an overview of a run.

    Parameters
    ----------
    columns
        As `dcmp_hil.telemetry.signals.columns` gives them; those that are missing or all NaN are left out.
    title
        Stands above the plots.
    path
        The picture; its ending says which format.

    Raises
    ------
    ConfigError
        If matplotlib is missing, or the file cannot be written.
    """
    with files_only():
        try:
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure
        except ImportError:
            raise ConfigError(
                "Drawing needs matplotlib, which is not installed. Install it: pip install matplotlib"
            ) from None
        figure = Figure(figsize=(12.8, 7.6), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, fontsize=13, fontweight="bold", x=0.012, ha="left")
        _draw_panels(figure, columns)
        _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    try:
        with whole_file(path) as place:
            figure.savefig(place, dpi=150, format=path.suffix[1:] or "png")
    except (OSError, ValueError) as error:  # ValueError: an ending that is no format
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"{path}: {reason}. Choose a .png file that you may write.") from None


def thinned(time: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Reduce a long line to the extremes of each stretch of it, so that no peak is lost.

    Parameters
    ----------
    time, values
        Shape (n,).

    Returns
    -------
    tuple of ndarray
        Time and values; as they were up to 20,000 points.
    """
    if len(time) <= _POINTS_MAX:
        return time, values
    low = np.where(np.isnan(values), np.inf, values)
    high = np.where(np.isnan(values), -np.inf, values)
    keep = {0, len(time) - 1}
    for rows in np.array_split(np.arange(len(time)), _BUCKET_COUNT):
        keep.add(int(rows[np.argmin(low[rows])]))
        keep.add(int(rows[np.argmax(high[rows])]))
    chosen = np.array(sorted(keep))
    return time[chosen], values[chosen]


def _draw_panels(figure: Figure, columns: Columns) -> None:
    plots = by_plot()
    rows = math.ceil(len(plots) / _PLOT_COLUMNS)
    grid = figure.subplots(rows, _PLOT_COLUMNS, sharex=True, squeeze=False)
    panels = list(grid.T.flat)
    for axes in panels[len(plots) :]:
        axes.remove()
    for axes, (name, signals) in zip(panels, plots.items(), strict=False):
        _draw_panel(axes, columns, signals)
        _dress(axes, name)
        if name == "control/tracking_error_mrad":
            _fit_to_second_half(axes)
    for axes in (panels[rows - 1], panels[len(plots) - 1]):  # the lowest of each column
        axes.set_xlabel("time [s]", fontsize=9, color=_TEXT_COLOUR)
        axes.tick_params(labelbottom=True)


def _draw_panel(axes: Axes, columns: Columns, signals: list[Signal]) -> None:
    for signal in signals:
        values = columns.get(signal.column)
        if values is None or np.isnan(values).all():
            continue
        t, y = thinned(columns["time_s"], values)
        axes.plot(
            t,
            y,
            label=signal.label,
            color=[c / 255 for c in signal.colour],
            linewidth=_width(signal),
            drawstyle="steps-post" if signal.plot.endswith("_V") else "default",
        )
    if signals[0].plot.endswith("_V"):
        _fit_to_sent(axes, columns)
    if len(axes.lines) > 1:
        # Above the lines, level with the title: inside, it would hide some of them.
        axes.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            borderaxespad=0.15,
            fontsize=8,
            frameon=False,
            ncols=4,
            handlelength=1.6,
        )


def _width(signal: Signal) -> float:
    """Draw what comes first wider, so that it shows as a rim where lines lie on one another."""
    return {TRUE_RGB: 3.6, ESTIMATE_RGB: 2.2}.get(signal.colour, 1.0)


def _fit_to_sent(axes: Axes, columns: Columns) -> None:
    sent = columns.get("voltage_sent_V")
    if sent is not None and not np.isnan(sent).all():
        reach = _DEMAND_CLIP_RATIO * float(np.nanmax(np.abs(sent))) or 1.0
        axes.set_ylim(-reach, reach)


def _fit_to_second_half(axes: Axes) -> None:
    """Leave a start that dwarfs all that follows outside, and say so."""
    if not axes.lines:
        return
    size = np.abs(np.asarray(axes.lines[0].get_ydata(), dtype=np.float64))
    if np.isnan(size[len(size) // 2 :]).all():
        return
    whole, half = float(np.nanmax(size)), float(np.nanmax(size[len(size) // 2 :]))
    if half > 0.0 and whole > _START_ERROR_RATIO * half:
        axes.set_ylim(-1.5 * half, 1.5 * half)
        axes.set_title(f"start beyond the scale: {whole:.4g}", loc="right", fontsize=8.5, color=_TEXT_COLOUR)


def _dress(axes: Axes, name: str) -> None:
    axes.set_title(title(name), loc="left", fontsize=10, color=_TEXT_COLOUR)
    axes.grid(visible=True, color="#e3e6ea", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.margins(x=0.0, y=0.08)
    axes.tick_params(labelsize=8.5, colors=_TEXT_COLOUR, length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
