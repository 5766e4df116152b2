"""The picture of docs/observers.md, one reversal as every observer sees it: python -m tools.reversal [FILE].

The ride is in virtual time, and every observer is given the same samples.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dcmp_hil.telemetry.signals import ESTIMATE_RGB, TRUE_RGB
from tools.nominal_ride import fresh, kinds, ride, samples

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Values = NDArray[np.float64]

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "observers-reversal.png"
CLOSED_BY = "super_twisting"
_RIDE_S, _SETTLED_S = 12.0, 5.0
_BEFORE_S, _AFTER_S = 0.2, 0.6  # of the reversal
_UNSCALED = ("paper",)  # kinds that are too rough to decide the scale
_DOTS_PER_INCH, _WIDTH_IN, _ROW_IN = 150, 8.0, 1.15
_INK, _GRID = "#30363d", "#d9dee3"
_STYLE: dict[Any, Any] = {
    "font.size": 8.5,
    "text.color": _INK,
    "axes.edgecolor": _INK,
    "axes.labelcolor": _INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlepad": 3.0,
    "axes.titlesize": 8.5,
    "grid.color": _GRID,
    "grid.linewidth": 0.5,
    "xtick.color": _INK,
    "ytick.color": _INK,
}


class Seen(NamedTuple):
    """A reversal as an observer sees it."""

    velocity_error: Values  # rad/s
    disturbance: Values  # rad/s2


class Reversal(NamedTuple):
    """A reversal, and what every observer makes of it."""

    time: Values  # s, from the reversal on
    disturbance: Values  # rad/s2, the true one
    seen: dict[str, Seen]  # by kind


def reversal() -> Reversal:
    """Return the first reversal of a ride that has settled."""
    columns = ride(CLOSED_BY, _RIDE_S)
    t, v, w = (columns[name] for name in ("time_s", "velocity_true_rad_s", "disturbance_true_rad_s2"))
    turned = np.flatnonzero((v[1:] * v[:-1] <= 0.0) & (t[1:] > _SETTLED_S))
    at = float(t[turned[0] + 1])
    shown = (t >= at - _BEFORE_S) & (t <= at + _AFTER_S)
    met = samples(columns)
    seen = {}
    for kind in kinds():
        update = fresh(kind).update
        estimates = np.array([update(sample) for sample in met])[shown]
        seen[kind] = Seen(estimates[:, 1] - v[shown], estimates[:, 2])
    return Reversal(t[shown] - at, w[shown], seen)


def draw(found: Reversal, path: Path) -> None:
    """Draw a row for each observer: the error of its velocity, and its disturbance beside the true one."""
    with mpl.rc_context(_STYLE):
        rows = len(found.seen)
        figure = Figure(figsize=(_WIDTH_IN, 0.7 + _ROW_IN * rows), dpi=_DOTS_PER_INCH, layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(rows, 2, sharex=True, sharey="col")
        for (kind, seen), (left, right) in zip(found.seen.items(), grid, strict=True):
            _draw_panel(left, kind, found.time, np.zeros_like(found.time), seen.velocity_error)
            _draw_panel(right, kind, found.time, found.disturbance, seen.disturbance)
        scaled = [seen for kind, seen in found.seen.items() if kind not in _UNSCALED]
        _finish(grid[:, 0], "Error of the velocity, rad/s", [seen.velocity_error for seen in scaled])
        _finish(grid[:, 1], "Disturbance, rad/s²", [seen.disturbance for seen in scaled])
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2, frameon=False)
        figure.savefig(path, metadata={"Software": None})  # the same bytes from every run


def _draw_panel(axes: Axes, kind: str, t: Values, true: Values, estimate: Values) -> None:
    for line, rgb, width, label in (
        (true, TRUE_RGB, 3.0, "true"),
        (estimate, ESTIMATE_RGB, 1.0, "estimated"),
    ):
        axes.plot(t, line, color=[channel / 255 for channel in rgb], linewidth=width, label=label)
    axes.set_title(kind, loc="left", fontweight="bold")
    cut = "cut off; " if kind in _UNSCALED else ""
    axes.set_title(f"{cut}largest error {np.abs(estimate - true).max():.2g}", loc="right")
    axes.grid(visible=True)


def _finish(column: Sequence[Axes], heading: str, lines: Sequence[Values]) -> None:
    """Give a column its heading, and a scale that holds all `lines`."""
    low, high = min(line.min() for line in lines), max(line.max() for line in lines)
    margin = 0.05 * (high - low)
    first, last = column[0], column[-1]
    first.set_ylim(low - margin, high + margin)
    first.set_xlim(-_BEFORE_S, _AFTER_S)
    first.annotate(heading, (0.0, 1.0), (0.0, 20.0), "axes fraction", "offset points", fontsize=10.0)
    last.set_xlabel("time from the reversal, s")


def main() -> int:
    """Draw the picture."""
    parser = argparse.ArgumentParser(prog="python -m tools.reversal", description=__doc__)
    parser.add_argument("picture", type=Path, nargs="?", default=PICTURE, metavar="FILE")
    path: Path = parser.parse_args().picture
    path.parent.mkdir(parents=True, exist_ok=True)
    draw(reversal(), path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
