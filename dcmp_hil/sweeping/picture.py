"""The picture of a sweep: a heat map over a grid, a tornado of many keys, or a distribution."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.common.atomic_file import whole_file
from dcmp_hil.common.drawing import files_only
from dcmp_hil.errors import ConfigError
from dcmp_hil.sweeping.result import JUDGED

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from dcmp_hil.sweeping.result import SweepResult

_TEXT, _GRID, _BLUE, _DARK_BLUE, _RED = "#4a4f57", "#e3e6ea", "#8fb4dc", "#20558f", "#c23b35"
_LABEL = "tracking error, RMS [mrad]"
_KEYS_MAX = 10  # bars of a tornado
_WRITTEN_CELLS_MAX = 12  # of a side of a heat map whose numbers are written into it
_TICKS_MAX = 12
_SHARE = 0.25  # of the runs, at either end of a key's values


def draw_sweep(result: SweepResult, path: Path) -> str:
    """Draw the tracking error over what was swept, and say in a word what was drawn.

    Two keys of a grid with more than one value: a heat map of the median over all else. Otherwise several
    keys that are numbers: a tornado of what each one alone does. Otherwise: the distribution.

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
                "The picture needs matplotlib. Install it: pip install 'dcmp-hil[sweep]'"
            ) from None
        figure = Figure(figsize=(9.6, 5.4), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        kind = _draw(figure, axes, result)
        try:
            with whole_file(path) as place:
                figure.savefig(place, dpi=150, format="png")
        except OSError as error:
            raise ConfigError(f"{path}: {error.strerror}. Choose a place you may write.") from None
    return kind


def _draw(figure: Figure, axes: Axes, result: SweepResult) -> str:
    grid = [key for key, axis in zip(result.spec.grid, result.spec.axes, strict=True) if len(axis) > 1]
    error = 1e3 * result.column(JUDGED).astype(np.float64)
    error[result.tripped | result.refused] = np.nan
    numbers = [key for key in result.spec.keys if _is_number(result.column(key))]
    whole = not np.isnan(error).all()
    if len(grid) == 2 and not result.spec.draw:  # noqa: PLR2004 - a picture has two sides
        _heat_map(figure, axes, result, grid, error)
        kind = "heat map"
    elif len(numbers) > 1 and whole:
        _tornado(axes, {key: result.column(key).astype(np.float64) for key in numbers}, error)
        kind = "tornado"
    else:
        _distribution(axes, error)
        kind = "distribution"
    ended, refused = int(result.tripped.sum()), int(result.refused.sum())
    figure.suptitle(
        f"{result.spec.rig}: {len(error):,} runs of {result.spec.duration_s:g} s, {ended:,} ended by the "
        f"supervisor, {refused:,} refused",
        fontsize=12,
        fontweight="bold",
        x=0.012,
        ha="left",
    )
    return kind


def _is_number(values: NDArray[Any]) -> bool:
    return values.dtype.kind in "if" and len(np.unique(values)) > 1


def _heat_map(
    figure: Figure, axes: Axes, result: SweepResult, keys: list[str], error: NDArray[np.float64]
) -> None:
    """Draw the median at each point of a grid; a cell without a whole run stays empty, and is crossed."""
    (down, across), columns = keys, [result.column(key) for key in keys]
    rows, row = np.unique(columns[0], return_inverse=True)
    cols, col = np.unique(columns[1], return_inverse=True)
    cells = np.full((len(rows), len(cols)), np.nan)
    for place in np.ndindex(cells.shape):
        inside = error[(row == place[0]) & (col == place[1])]
        inside = inside[~np.isnan(inside)]
        cells[place] = np.median(inside) if len(inside) else np.nan
    axes.set_facecolor("#f4e3e2")
    image = axes.imshow(cells, origin="lower", aspect="auto", cmap="viridis")
    figure.colorbar(image, ax=axes, label=f"{_LABEL}, median; pale red: ended or refused")
    if max(cells.shape) <= _WRITTEN_CELLS_MAX:
        middle = np.nanmean([np.nanmin(cells), np.nanmax(cells)]) if not np.isnan(cells).all() else 0.0
        for (y, x), value in np.ndenumerate(cells):
            text, colour = ("x", _RED) if np.isnan(value) else (f"{value:.3g}", "black")
            axes.text(x, y, text, ha="center", va="center", fontsize=9,
                      color="white" if value < middle else colour)  # fmt: skip
    _ticks(axes.set_xticks, cols)
    _ticks(axes.set_yticks, rows)
    axes.set_xlabel(across, color=_TEXT)
    axes.set_ylabel(down, color=_TEXT)


def _ticks(place: Any, values: NDArray[Any]) -> None:
    step = -(-len(values) // _TICKS_MAX)
    shown = range(0, len(values), step)
    place(list(shown), [_short(values[k]) for k in shown], fontsize=8.5, color=_TEXT)


def _short(value: Any) -> str:
    return f"{value:.4g}" if np.asarray(value).dtype.kind in "if" else str(value)


def _tornado(axes: Axes, columns: dict[str, NDArray[np.float64]], error: NDArray[np.float64]) -> None:
    """Draw for each key the median error of its lowest and of its highest quarter of values."""
    known = ~np.isnan(error)
    middle = float(np.median(error[known]))
    bars = []
    for key, values in columns.items():
        low, high = np.quantile(values[known], (_SHARE, 1.0 - _SHARE))
        ends = [float(np.median(error[known & part])) for part in (values <= low, values >= high)]
        bars.append((abs(ends[1] - ends[0]), key, ends, (low, high)))
    bars = sorted(bars, key=lambda bar: bar[0])[-_KEYS_MAX:]
    for y, (_, _, ends, bounds) in enumerate(bars):
        for end, colour, bound, sign, side in zip(
            ends, (_DARK_BLUE, _BLUE), bounds, "≤≥", (-0.17, 0.17), strict=True
        ):
            axes.barh(y + side, end - middle, left=middle, color=colour, height=0.32)
            axes.annotate(f"{sign} {bound:.4g}", (end, y + side), xytext=(4 if end >= middle else -4, 0),
                          textcoords="offset points", va="center", fontsize=8.5, color=_TEXT,
                          ha="left" if end >= middle else "right")  # fmt: skip
    axes.axvline(middle, color=_TEXT, linewidth=1.0)
    axes.set_yticks(range(len(bars)), [key for _, key, _, _ in bars], fontsize=9, color=_TEXT)
    axes.set_xlabel(f"{_LABEL}: median of the lowest and of the highest quarter of a key", color=_TEXT)
    axes.margins(x=0.16)
    _dress(axes)


def _distribution(axes: Axes, error: NDArray[np.float64]) -> None:
    known = error[~np.isnan(error)]
    if len(known):
        axes.hist(known, bins="sqrt" if len(known) < 1000 else "fd", color=_BLUE, edgecolor="white")  # noqa: PLR2004
        for share, style in ((0.05, ":"), (0.5, "-"), (0.95, ":")):
            value = float(np.quantile(known, share))
            axes.axvline(value, color=_DARK_BLUE, linewidth=1.4, linestyle=style)
            axes.annotate(f"{share:.0%}: {value:.3g}", (value, 1.0), xycoords=("data", "axes fraction"),
                          xytext=(3, -4), textcoords="offset points", va="top", fontsize=8.5, rotation=90,
                          color=_DARK_BLUE)  # fmt: skip
    else:
        axes.text(0.5, 0.5, "no run was whole", transform=axes.transAxes, ha="center", color=_RED)
    axes.margins(y=0.22)  # the words of the lines stand there
    axes.set_xlabel(_LABEL, color=_TEXT)
    axes.set_ylabel("runs", color=_TEXT)
    _dress(axes)


def _dress(axes: Axes) -> None:
    axes.grid(visible=True, color=_GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8.5, colors=_TEXT, length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
