"""The plots of the dashboard: which lines each has, and which signals every line stands for.

The table of signals says what is kept of a run, this table what of it is drawn while it goes on: errors in
plots of their own, and at most three lines in a plot. A signal that no line here stands for is drawn in the
plot that its own row names, so that a new signal is one place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.telemetry import signals
from dcmp_hil.telemetry.plot_labels import title
from dcmp_hil.telemetry.rerun.histogram import HISTOGRAMS
from dcmp_hil.telemetry.rerun.shadow_lines import shadow_lines
from dcmp_hil.telemetry.signals import (
    DEMAND_RGB,
    ERROR_RGB,
    ESTIMATE_RGB,
    FAINT_RGB,
    FRICTION_RGB,
    GRAVITY_RGB,
    REFERENCE_RGB,
    REST_RGB,
    TRUE_RGB,
    VOLTAGE_RGB,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block

    Column = NDArray[np.float64]

VOLTAGE, TIMING = "control/voltage_V", "loop/timing_us"
DISTURBANCE, DISTURBANCE_ERRORS = "joint/disturbance_rad_s2", "errors/disturbance_rad_s2"


class Known(NamedTuple):
    """Parts that are known of the plant, which decide the lines."""

    truth: bool = True
    model: bool = True


@dataclass(frozen=True, slots=True)
class Line:
    """One line of one plot."""

    label: str
    colour: tuple[int, int, int]
    read: Callable[[Block], Column]
    columns: tuple[str, ...] = ()
    """Signals for which it stands."""
    truth: bool | None = None
    """Whether it is drawn with a known truth only, or without it only; None for both."""
    model: bool | None = None
    """The same of the model."""
    clipped: bool = False
    """Whether it is drawn no further than a little beyond the voltage limit."""

    def drawn(self, known: Known) -> bool:
        """Return whether the line is drawn."""
        return self.truth in {None, known.truth} and self.model in {None, known.model}


@dataclass(frozen=True, slots=True)
class Plot:
    """One plot, with its entity."""

    path: str  # with its unit
    lines: tuple[Line, ...]
    name: str = ""
    """Title; empty takes it from the path."""
    wrong: bool = False
    """Whether it is of the column "how wrong", and not of "what happens"."""
    frozen: bool = False
    """Whether it ends with a trip: later references and estimates mean nothing, and would flatten it."""
    needs: tuple[str, ...] = ()
    """Further columns without which it is not there."""
    beside: str = ""
    """Path of the plot whose place it shares, as a tab; empty for a place of its own."""

    @property
    def titled(self) -> str:
        """Return the title with its unit."""
        return self.name or title(self.path)


def _position(block: Block) -> Column:
    true = block["position_true"]
    return np.where(np.isnan(true), block["position"], true)


def _velocity(block: Block) -> Column:
    true = block["velocity_true"]
    return np.where(np.isnan(true), block["velocity_estimate"], true)


def _engaged(block: Block, values: Column) -> Column:
    """Return the values from the beginning of the trajectory on; before it, nothing is asked for."""
    return np.where(block["t"] < block["began"], np.nan, values)


_PLOTS = (
    Plot(
        "joint/position_rad",
        (
            Line("true", TRUE_RGB, _position, ("position_true_rad", "position_rad"), truth=True),
            Line("measured", TRUE_RGB, _position, ("position_rad",), truth=False),
            Line("reference", REFERENCE_RGB, lambda b: b.reference[:, 0], ("position_reference_rad",)),
        ),
    ),
    Plot(
        "joint/velocity_rad_s",
        frozen=True,
        lines=(
            Line("estimate", ESTIMATE_RGB, lambda b: b["velocity_estimate"], ("velocity_estimate_rad_s",)),
            Line("reference", REFERENCE_RGB, lambda b: b.reference[:, 1], ("velocity_reference_rad_s",)),
        ),
    ),
    Plot(
        DISTURBANCE,
        frozen=True,
        lines=(
            Line("true", TRUE_RGB, lambda b: b["disturbance_true"], ("disturbance_true_rad_s2",), truth=True),
            Line(
                "estimate",
                ESTIMATE_RGB,
                lambda b: b["disturbance_estimate"],
                ("disturbance_estimate_rad_s2",),
            ),
            Line("model", GRAVITY_RGB, lambda b: b.gravity + b.friction, truth=True, model=True),
            Line("gravity", GRAVITY_RGB, lambda b: b.gravity, ("gravity_rad_s2",), truth=False, model=True),
            Line(
                "friction", FRICTION_RGB, lambda b: b.friction, ("friction_rad_s2",), truth=False, model=True
            ),
        ),
    ),
    Plot(
        VOLTAGE,
        (
            Line(
                "demanded",
                DEMAND_RGB,
                lambda b: _engaged(b, b["voltage_demand"]),
                ("voltage_demand_V", "voltage_sent_V"),  # what was sent is the demand within its limits
                clipped=True,
            ),
            Line("applied", VOLTAGE_RGB, lambda b: b["voltage_applied"], ("voltage_applied_V",)),
        ),
    ),
    Plot(
        "errors/position_mrad",
        (
            Line("tracking", ERROR_RGB, lambda b: 1e3 * b.tracking_error, ("tracking_error_mrad",)),
            Line(
                "estimate",
                ESTIMATE_RGB,
                lambda b: 1e3 * (b["position_estimate"] - b["position_true"]),
                ("position_estimate_rad",),
                truth=True,
            ),
            Line(
                "est.-meas.",
                ESTIMATE_RGB,
                lambda b: 1e3 * (b["position_estimate"] - b["position"]),
                ("position_estimate_rad",),
                truth=False,
            ),
        ),
        name="Position errors [mrad]",
        wrong=True,
        frozen=True,
    ),
    Plot(
        "errors/velocity_mrad_s",
        (
            Line("tracking", ERROR_RGB, lambda b: 1e3 * _engaged(b, _velocity(b) - b.reference[:, 1])),
            Line(
                "estimate",
                ESTIMATE_RGB,
                lambda b: 1e3 * (b["velocity_estimate"] - b["velocity_true"]),
                ("velocity_true_rad_s",),
                truth=True,
            ),
        ),
        name="Velocity errors [mrad/s]",
        wrong=True,
        frozen=True,
    ),
    Plot(
        DISTURBANCE_ERRORS,
        (
            Line(
                "estimate",
                ESTIMATE_RGB,
                lambda b: b["disturbance_estimate"] - b["disturbance_true"],
                truth=True,
            ),
            Line(
                "rest",
                REST_RGB,
                lambda b: b["disturbance_estimate"] - b.gravity - b.friction,
                ("unexplained_rad_s2",),
                model=True,
            ),
        ),
        name="Disturbance: estimate error, rest [rad/s²]",
        wrong=True,
        frozen=True,
    ),
    Plot(
        TIMING,
        (
            Line("late", ERROR_RGB, lambda b: 1e6 * b["lateness"], ("lateness_us",)),
            Line("compute", FAINT_RGB, lambda b: 1e6 * b["compute"], ("compute_us",)),
        ),
        name="Timing, worst [µs]",
        wrong=True,
    ),
    Plot(
        "observer/disturbance_rad_s2",
        (Line("found", ESTIMATE_RGB, lambda b: b["disturbance_found_rad_s2"]),),
        name="Disturbance beyond gravity and friction [rad/s²]",
        frozen=True,
        needs=("disturbance_found_rad_s2",),
        beside=DISTURBANCE,
    ),
    Plot(
        "observer/friction_rad_s2",
        (
            Line("difference", ESTIMATE_RGB, lambda b: b["friction_found_rad_s2"] - b.model.f1),
            Line("deviation", FAINT_RGB, lambda b: b["friction_deviation_rad_s2"]),
            Line("deviation", FAINT_RGB, lambda b: -b["friction_deviation_rad_s2"]),
        ),
        name="Friction: found minus model [rad/s²]",
        wrong=True,
        frozen=True,
        needs=("friction_found_rad_s2", "friction_deviation_rad_s2"),
        beside=TIMING,
    ),
)


def plots(further: tuple[str, ...] = ()) -> tuple[Plot, ...]:
    """Return every plot of a run with these further columns.

    They are the table's own, with the lines of observers that ran beside the loop, and those of the signals
    that no line of it stands for.
    """
    own = [plot for plot in _PLOTS if set(plot.needs) <= set(further)]
    told = {histogram.column for histogram in HISTOGRAMS}
    told |= {column for plot in own for line in plot.lines for column in line.columns}
    more: dict[str, list[Line]] = {}
    for signal in signals.SIGNALS:
        if signal.column not in told:
            line = Line(signal.label, signal.colour, signal.read, (signal.column,))
            more.setdefault(signal.plot, []).append(line)
    for path, label, colour, read, truth in shadow_lines(further):
        more.setdefault(path, []).append(Line(label, colour, read, truth=truth))
    grown = [replace(plot, lines=(*plot.lines, *more.pop(plot.path, ()))) for plot in own]
    return (*grown, *(Plot(path, tuple(lines)) for path, lines in more.items()))


def known_of(block: Block) -> Known:
    """Return what is known of the plant.

    It is taken from the position: even a simulation knows no disturbance before its first step.
    """
    return Known(not np.isnan(block["position_true"]).all(), not np.isnan(block.gravity).all())
