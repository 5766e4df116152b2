"""The phase portrait: velocity over position, drawn with its own axes, since Rerun's 2D view has none."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from dcmp_hil.telemetry.signals import ESTIMATE_RGB, REFERENCE_RGB

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block

PATH = "portrait"
_TRAIL_S = 10.0  # s
_POINT_RATE_HZ, _PICTURE_RATE_HZ = 50, 5
_AXIS_HALF_RANGE_MIN = 0.1  # rad and rad/s: a portrait of an arm at rest is not one of its noise
_AXIS_RGB, _TEXT_RGB = (80, 84, 92), (150, 155, 160)
_AXIS_MARGIN_RATIO = 1.12  # of the axes, for their labels
_AXIS_OVERSHOOT_MAX = 1.05  # of an axis: what is a little more than 1 has no axis to 2

Call = tuple[str, rr.ComponentColumnList]


def round_up(value: float) -> float:
    """Return the next of 1, 2, 5 x 10^n: what an axis can end at."""
    decade: float = 10.0 ** math.floor(math.log10(value / _AXIS_OVERSHOOT_MAX))
    return next(
        step * decade for step in (1.0, 2.0, 5.0, 10.0) if value <= step * decade * _AXIS_OVERSHOOT_MAX
    )


class Portrait:
    """Collects points, and draws the last ten seconds five times a second.

    Attributes
    ----------
    points
        Shape (n, 5): t, position and velocity of the estimate, those of the reference.
    """

    def __init__(self) -> None:
        self.points = np.empty((0, 5))
        self._reach = (0.0, 0.0)
        self._slot = self._picture = -1

    def add(self, block: Block) -> None:
        """Add a block of at least one consecutive cycle."""
        reference = block.reference
        columns = [
            *(block["t"], block["position_estimate"], block["velocity_estimate"]),
            *(reference[:, 0], reference[:, 1]),
        ]
        table = np.column_stack(columns)
        table = table[np.isfinite(table).all(axis=1)]
        if not len(table):
            return
        slots = np.floor(table[:, 0] * _POINT_RATE_HZ + 1e-6).astype(np.int64)
        new = table[np.flatnonzero(np.diff(slots, prepend=self._slot))]
        self._slot = int(slots[-1])
        points = np.concatenate((self.points, new))
        self.points = points[points[:, 0] > table[-1, 0] - _TRAIL_S]

    def draw(self) -> tuple[float, list[Call]] | None:
        """Return time and what to send; None where the last picture is still new."""
        if not len(self.points):
            return None
        t = float(self.points[-1, 0])
        picture = int(t * _PICTURE_RATE_HZ + 1e-6)
        if picture == self._picture:
            return None
        self._picture = picture
        calls = []
        reach = self._find_reach()
        if reach != self._reach:
            self._reach = reach
            calls += _axes(*reach)
        for name, columns, colour, radius in (
            ("reference", (3, 4), REFERENCE_RGB, 0.018),
            ("estimate", (1, 2), ESTIMATE_RGB, 0.008),
        ):
            strip = self._scaled(self.points[:, columns])
            lines = rr.LineStrips2D.columns(strips=[strip], colors=[colour], radii=[radius])
            calls += [
                (f"{PATH}/{name}", lines),
                (
                    f"{PATH}/{name}/now",
                    rr.Points2D.columns(positions=strip[-1:], colors=[colour], radii=[0.03]),
                ),
            ]
        return t, calls

    def axes(self) -> list[Call]:
        """Return the axes as they were last drawn; nothing before that."""
        return _axes(*self._reach) if self._reach[0] else []

    def _find_reach(self) -> tuple[float, float]:
        """Return the ends of the axes, rad and rad/s: never smaller than before, so that nothing jitters."""
        most = np.abs(self.points[:, 1:]).max(axis=0)
        position, velocity = (
            max(most[0], most[2], _AXIS_HALF_RANGE_MIN),
            max(most[1], most[3], _AXIS_HALF_RANGE_MIN),
        )
        return max(self._reach[0], round_up(position)), max(self._reach[1], round_up(velocity))

    def _scaled(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scale to a square of +-1; in a 2D view, y points down."""
        scaled: NDArray[np.float64] = points / np.array([self._reach[0], -self._reach[1]])
        return scaled


def _axes(position: float, velocity: float) -> list[Call]:
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)], float)
    strips = [square, np.array([(-1.0, 0.0), (1.0, 0.0)]), np.array([(0.0, -1.0), (0.0, 1.0)])]
    lines = rr.LineStrips2D.columns(strips=strips, colors=[_AXIS_RGB] * 3, radii=[0.004] * 3).partition([3])
    places = np.array(
        [
            (-1, _AXIS_MARGIN_RATIO),
            (1, _AXIS_MARGIN_RATIO),
            (0, _AXIS_MARGIN_RATIO),
            (0, -_AXIS_MARGIN_RATIO),
        ],
        float,
    )
    labels = [f"{-position:g} rad", f"{position:g} rad", f"{-velocity:g} rad/s", f"{velocity:g} rad/s"]
    names = rr.Points2D.columns(positions=places, labels=labels, colors=[_TEXT_RGB] * 4, radii=[0.001] * 4)
    return [(f"{PATH}/axes", lines), (f"{PATH}/axes/ends", names.partition([4]))]
