"""Contents of figures 1 to 4 of the paper: panels, lines and series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from dcmp_hil.telemetry.signals import ERROR_RGB, ESTIMATE_RGB, REFERENCE_RGB, TRUE_RGB, VOLTAGE_RGB

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.result import Result


@dataclass(frozen=True, slots=True)
class FigureLine:
    """One line: a key of `series`, its name in the legend, its colour."""

    series: str
    label: str
    colour: tuple[int, int, int]
    dashed: bool = False  # lies on another line, which must show through
    width: float = 1.2  # points


@dataclass(frozen=True, slots=True)
class FigurePanel:
    """One quantity: the first second on the left, what follows on the right.

    Parameters
    ----------
    label
        Quantity and unit.
    lines
        In the order of drawing.
    legend
        Corner of the left side where the names stand; none for a single line.
    late_label, late_scale
        Unit of the right side, where it is so much smaller that it needs one of its own.
    shared
        Both sides have the same vertical scale.
    zoom
        Left, right, bottom and top of an inset on the left side.
    """

    label: str
    lines: tuple[FigureLine, ...]
    legend: Literal["upper right", "lower right"] | None = None
    late_label: str = ""
    late_scale: float = 1.0
    shared: bool = False
    zoom: tuple[float, float, float, float] | None = None


_X1, _X2 = FigureLine("x1", "$x_1$", TRUE_RGB), FigureLine("x2", "$x_2$", TRUE_RGB)
_X1_HAT = FigureLine("x1_hat", r"$\hat{x}_1$", ESTIMATE_RGB, dashed=True)
_X2_HAT = FigureLine("x2_hat", r"$\hat{x}_2$", ESTIMATE_RGB, dashed=True)
_XR = FigureLine("xr", "$x_r$", REFERENCE_RGB, dashed=True)
_E1, _E2 = r"$\hat{x}_1 - x_1$", r"$\hat{x}_2 - x_2$"

FIGURES: dict[str, tuple[str, tuple[FigurePanel, ...]]] = {
    "figure-1-state.png": (
        "Figure 1. State of the servomechanism, and its estimate",
        (
            FigurePanel("position, rad", (_X1, _X1_HAT), "lower right", shared=True),
            FigurePanel("velocity, rad/s", (_X2, _X2_HAT), "upper right"),
        ),
    ),
    "figure-2-estimation-error.png": (
        "Figure 2. Estimation error; the spikes are reversals, where Coulomb friction jumps",
        (
            FigurePanel(
                f"{_E1}, rad",
                (FigureLine("x1_error", "", ERROR_RGB, width=0.8),),
                late_label=f"{_E1}, nrad",
                late_scale=1e9,
            ),
            FigurePanel(
                f"{_E2}, rad/s",
                (FigureLine("x2_error", "", ERROR_RGB, width=0.8),),
                late_label=f"{_E2}, mrad/s",
                late_scale=1e3,
            ),
        ),
    ),
    "figure-3-tracking.png": (
        "Figure 3. Tracking of the reference, and its error",
        (
            FigurePanel("position, rad", (_X1, _XR), "lower right", shared=True),
            FigurePanel(
                "$x_1 - x_r$, rad",
                (FigureLine("tracking", "", ERROR_RGB, width=0.8),),
                late_label="$x_1 - x_r$, µrad",
                late_scale=1e6,
            ),
        ),
    ),
    "figure-4-control.png": (
        "Figure 4. Control signal and disturbance",
        (
            FigurePanel(
                r"control $\tau$, V",
                (FigureLine("voltage", "", VOLTAGE_RGB, width=1.0),),
                zoom=(0.0, 0.5, -140.0, 60.0),
            ),
            FigurePanel(r"disturbance $\eta/J$, rad/s²", (FigureLine("eta", "", TRUE_RGB),), shared=True),
            FigurePanel(
                "$w$, rad/s²",
                (FigureLine("w_hat", r"$\hat{w}$", ESTIMATE_RGB), FigureLine("w", "$w$", TRUE_RGB)),
                "upper right",
            ),
        ),
    ),
}
"""File name to title and panels, in the paper's order."""


def series(result: Result) -> dict[str, NDArray[np.float64]]:
    """Return what the lines draw, by name: shape (n,), SI units; `t` is device time."""
    columns = result.columns
    plant, t = result.rig.plant, columns["time_s"]
    x1, x2 = columns["position_true_rad"], columns["velocity_true_rad_s"]
    x1_hat, x2_hat = columns["position_estimate_rad"], columns["velocity_estimate_rad_s"]
    return {
        "t": t,
        "x1": x1,
        "x2": x2,
        "x1_hat": x1_hat,
        "x2_hat": x2_hat,
        "x1_error": x1_hat - x1,
        "x2_error": x2_hat - x2,
        "xr": columns["position_reference_rad"],
        "tracking": 1e-3 * columns["tracking_error_mrad"],
        "voltage": columns["voltage_sent_V"],
        "eta": plant.eta + plant.eta_amplitude * np.sin(plant.eta_rate * t),
        "w": columns["disturbance_true_rad_s2"],
        "w_hat": columns["disturbance_estimate_rad_s2"],
    }
