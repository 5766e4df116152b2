"""Figures 1 to 4 of the paper, drawn from the corrected run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.common.atomic_file import whole_file
from dcmp_hil.common.drawing import files_only
from dcmp_hil.errors import ConfigError
from dcmp_hil.paper.panels import FIGURES, FigurePanel, series

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from dcmp_hil.paper.reproduction import Reproduction

    Table = dict[str, NDArray[np.float64]]

_TRANSIENT_END_S = 1.0  # s: left of it the transient, right of it what the paper judges
_LEFT_MARGIN_S = 0.02  # s, left of t = 0, so that what happens there is not hidden by the axis
_DOTS_PER_INCH = 200
_INK, _GRID = "#30363d", "#d9dee3"
_STYLE: dict[Any, Any] = {  # matplotlib's type of its keys changes from release to release
    "font.size": 9.0,
    "text.color": _INK,
    "axes.edgecolor": _INK,
    "axes.labelcolor": _INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": _GRID,
    "grid.linewidth": 0.5,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
}


def draw(reproduction: Reproduction, folder: Path) -> list[Path]:
    """Draw figures 1 to 4 of the paper as PNG files.

    Parameters
    ----------
    reproduction
        From `reproduce`; the corrected run is drawn.
    folder
        Where to; made if it is not there. Files of the same name are replaced.

    Returns
    -------
    list of Path
        The files written, in the paper's order.

    Raises
    ------
    ConfigError
        If matplotlib is missing or the folder cannot be written.
    """
    with files_only():
        try:
            import matplotlib as mpl
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure
        except ImportError:
            raise ConfigError(
                "Figures need matplotlib. Install it: pip install matplotlib, or use --no-figures."
            ) from None
        table = series(reproduction.corrected)
        written = []
        with mpl.rc_context(_STYLE):
            for name, (title, panels) in FIGURES.items():
                figure = Figure(
                    figsize=(7.2, 0.5 + 1.9 * len(panels)), dpi=_DOTS_PER_INCH, layout="constrained"
                )
                FigureCanvasAgg(figure)
                _lay_out(figure, title, panels, table)
                written.append(_save(figure, folder / name))
    return written


def _lay_out(figure: Figure, title: str, panels: tuple[FigurePanel, ...], table: Table) -> None:
    figure.suptitle(title, x=0.01, ha="left", fontsize=10.0)
    grid = figure.subplots(len(panels), 2, sharex="col", squeeze=False, width_ratios=(1.0, 1.6))
    for panel, (left, right) in zip(panels, grid, strict=True):
        _draw_panel(left, right, panel, table)
    left, right = grid[-1]
    left.set_xlim(-_LEFT_MARGIN_S, _TRANSIENT_END_S)
    left.set_xticks([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    left.set_xlabel("time, s (the first second)")
    right.set_xlim(_TRANSIENT_END_S, float(table["t"][-1]))
    right.set_xticks([1, 5, 10, 15, 20])
    right.set_xlabel("time, s (from then on)")
    figure.align_ylabels(grid[:, 0])
    figure.align_ylabels(grid[:, 1])


def _draw_panel(left: Axes, right: Axes, panel: FigurePanel, table: Table) -> None:
    early = table["t"] <= _TRANSIENT_END_S
    _draw_lines(left, panel, table, early)
    _draw_lines(right, panel, table, ~early, panel.late_scale)
    left.set_ylabel(panel.label)
    right.set_ylabel(panel.late_label)
    if panel.shared:
        right.sharey(left)
        right.autoscale_view()
    if panel.legend:
        left.legend(loc=panel.legend)
    if panel.zoom:
        start, stop, bottom, top = panel.zoom
        left.grid(visible=False)  # it would run through the figures of the inset
        inset = left.inset_axes((0.36, 0.42, 0.62, 0.56))
        _draw_lines(inset, panel, table, table["t"] <= stop)
        inset.set(xlim=(start, stop), ylim=(bottom, top))
        inset.tick_params(labelsize=7.0)


def _draw_lines(
    axis: Axes, panel: FigurePanel, table: Table, part: NDArray[np.bool_], scale: float = 1.0
) -> None:
    for line in panel.lines:
        axis.plot(
            table["t"][part],
            scale * table[line.series][part],
            color=tuple(channel / 255 for channel in line.colour),
            linestyle=(0, (4, 2)) if line.dashed else "-",
            linewidth=line.width,
            label=line.label,
        )
    axis.grid(visible=True)


def _save(figure: Figure, path: Path) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as place:
            figure.savefig(place, format=path.suffix[1:])
    except OSError as error:
        raise ConfigError(
            f"{path}: {error.strerror or error}. Choose another folder with --out, or use --no-figures."
        ) from None
    return path
