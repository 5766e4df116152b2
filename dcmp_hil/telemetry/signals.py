"""The one table of signals: plots, result columns and CSV all follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block

TRUE_RGB = (125, 145, 165)  # grey-blue: measured or true
ESTIMATE_RGB = (255, 160, 40)  # orange
REFERENCE_RGB = (90, 190, 95)  # green
ERROR_RGB = (240, 80, 80)  # red
VOLTAGE_RGB = (70, 150, 245)  # blue
DEMAND_RGB = (150, 190, 240)  # pale blue
TIMING_RGB = (190, 90, 200)  # purple
FAINT_RGB = (150, 150, 150)
GRAVITY_RGB = (95, 190, 200)  # teal
FRICTION_RGB = (200, 140, 225)  # lilac
REST_RGB = (225, 205, 95)  # yellow


@dataclass(frozen=True, slots=True)
class Signal:
    """One line of one plot, and one column of every table."""

    column: str  # with its unit
    plot: str  # entity path, with its unit
    label: str
    colour: tuple[int, int, int]
    read: Callable[[Block], NDArray[np.float64]]


SIGNALS = (
    Signal("position_rad", "joint/position_rad", "measured", TRUE_RGB, lambda b: b["position"]),
    Signal("position_true_rad", "joint/position_rad", "true (sim)", FAINT_RGB, lambda b: b["position_true"]),
    Signal(
        "position_estimate_rad",
        "joint/position_rad",
        "estimate",
        ESTIMATE_RGB,
        lambda b: b["position_estimate"],
    ),
    Signal(
        "position_reference_rad",
        "joint/position_rad",
        "reference",
        REFERENCE_RGB,
        lambda b: b.reference[:, 0],
    ),
    Signal(
        "velocity_true_rad_s", "joint/velocity_rad_s", "true (sim)", TRUE_RGB, lambda b: b["velocity_true"]
    ),
    Signal(
        "velocity_estimate_rad_s",
        "joint/velocity_rad_s",
        "estimate",
        ESTIMATE_RGB,
        lambda b: b["velocity_estimate"],
    ),
    Signal(
        "velocity_reference_rad_s",
        "joint/velocity_rad_s",
        "reference",
        REFERENCE_RGB,
        lambda b: b.reference[:, 1],
    ),
    Signal(
        "disturbance_true_rad_s2",
        "joint/disturbance_rad_s2",
        "true (sim)",
        TRUE_RGB,
        lambda b: b["disturbance_true"],
    ),
    Signal(
        "disturbance_estimate_rad_s2",
        "joint/disturbance_rad_s2",
        "estimate",
        ESTIMATE_RGB,
        lambda b: b["disturbance_estimate"],
    ),
    Signal("gravity_rad_s2", "joint/disturbance_rad_s2", "gravity (model)", GRAVITY_RGB, lambda b: b.gravity),
    Signal(
        "friction_rad_s2", "joint/disturbance_rad_s2", "friction (model)", FRICTION_RGB, lambda b: b.friction
    ),
    Signal(
        "unexplained_rad_s2",
        "joint/disturbance_rad_s2",
        "rest",
        REST_RGB,
        lambda b: b["disturbance_estimate"] - b.gravity - b.friction,
    ),
    Signal(
        "tracking_error_mrad",
        "control/tracking_error_mrad",
        "tracking error",
        ERROR_RGB,
        lambda b: 1e3 * b.tracking_error,
    ),
    Signal("voltage_demand_V", "control/voltage_V", "demanded", DEMAND_RGB, lambda b: b["voltage_demand"]),
    Signal("voltage_sent_V", "control/voltage_V", "sent", FAINT_RGB, lambda b: b["voltage_sent"]),
    Signal("voltage_applied_V", "control/voltage_V", "applied", VOLTAGE_RGB, lambda b: b["voltage_applied"]),
    Signal("period_us", "loop/timing_us", "period", TIMING_RGB, lambda b: 1e6 * b["period"]),
    Signal("lateness_us", "loop/timing_us", "lateness", ERROR_RGB, lambda b: 1e6 * b["lateness"]),
    Signal("compute_us", "loop/timing_us", "compute", FAINT_RGB, lambda b: 1e6 * b["compute"]),
)


def columns(block: Block) -> dict[str, NDArray[np.float64]]:
    """Read every signal of the table from `block`, and its further columns behind them.

    Returns
    -------
    dict
        Column name to shape (n,); `time_s` comes first.
    """
    further = {name: block[name] for name in block.further}
    return {"time_s": block["t"], **{signal.column: signal.read(block) for signal in SIGNALS}, **further}


def by_plot() -> dict[str, list[Signal]]:
    """Group the table by plot, both in the table's order."""
    plots: dict[str, list[Signal]] = {}
    for signal in SIGNALS:
        plots.setdefault(signal.plot, []).append(signal)
    return plots


def names(further: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return the names of the columns in their order, of a run with these further ones."""
    return ("time_s", *(signal.column for signal in SIGNALS), *further)
