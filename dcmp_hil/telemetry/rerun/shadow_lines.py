"""Lines of the observers that ran beside the loop, found by the names of a run's further columns."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block

    Column = NDArray[np.float64]

_VELOCITY = re.compile(r"velocity_(.+)_rad_s")
_COLOURS = (
    (235, 110, 190),  # pink
    (110, 215, 235),  # cyan
    (175, 220, 95),  # lime
    (250, 215, 110),  # straw
    (165, 140, 250),  # violet
    (240, 130, 90),  # brick
    (120, 225, 175),  # mint
    (210, 210, 215),  # silver
)
"""Of shadows, in their order: none is that of a line of the loop."""


class ShadowLine(NamedTuple):
    """A line of a plot; `truth` is whether it is drawn only where the truth is known."""

    plot: str
    label: str
    colour: tuple[int, int, int]
    read: Callable[[Block], Column]
    truth: bool | None


def shadow_lines(further: tuple[str, ...]) -> list[ShadowLine]:
    """Return the lines of every observer that ran beside the loop: estimates, and their errors.

    Parameters
    ----------
    further
        Names of the further columns of a run. An observer is one that has a velocity, a position and a
        disturbance among them.
    """
    names = [found[1] for name in further if (found := _VELOCITY.fullmatch(name))]
    names = [name for name in names if {f"position_{name}_rad", f"disturbance_{name}_rad_s2"} <= set(further)]
    lines = []
    for number, name in enumerate(names):
        colour = _COLOURS[number % len(_COLOURS)]
        velocity, disturbance = f"velocity_{name}_rad_s", f"disturbance_{name}_rad_s2"
        lines += [
            ShadowLine("joint/velocity_rad_s", name, colour, partial(_column, velocity), None),
            ShadowLine("joint/disturbance_rad_s2", name, colour, partial(_column, disturbance), None),
            ShadowLine(
                "errors/velocity_mrad_s", name, colour, partial(_error, velocity, "velocity_true", 1e3), True
            ),
            ShadowLine(
                "errors/disturbance_rad_s2",
                name,
                colour,
                partial(_error, disturbance, "disturbance_true", 1.0),
                True,
            ),
        ]
    return lines


def _column(name: str, block: Block) -> Column:
    return block[name]


def _error(name: str, true: str, scale: float, block: Block) -> Column:
    return scale * (block[name] - block[true])
