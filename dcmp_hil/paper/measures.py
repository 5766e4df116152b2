"""Figures of the paper, as numbers from one run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.assembly import make_controller
from dcmp_hil.values import Estimate, Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.result import Result

_SETTLED_ERROR_MAX_RAD_S = 0.1  # rad/s: the velocity estimate has arrived when its error stays below this


@dataclass(frozen=True, slots=True)
class Measures:
    """The figures of one run; those of steady state are over the result's own window."""

    voltage_at_start_V: float
    tracking_max_rad: float
    tracking_rms_rad: float
    velocity_error_max_rad_s: float
    disturbance_error_rms_rad_s2: float
    velocity_settled_s: float
    """From here on the velocity estimate is less than 0.1 rad/s off; NaN if it never settles."""
    voltage_peak_V: float
    damping: float
    """Of the closed loop, from the controller's own response."""


def measure(result: Result) -> Measures:
    """Return the figures of a run, compared with the truth.

    Parameters
    ----------
    result
        A run of the simulated rig with its columns.
    """
    figures, columns = result.summary, result.columns
    velocity_error = columns["velocity_estimate_rad_s"] - columns["velocity_true_rad_s"]
    return Measures(
        voltage_at_start_V=float(columns["voltage_sent_V"][0]),
        tracking_max_rad=_known(figures.tracking_max_rad),
        tracking_rms_rad=_known(figures.tracking_rms_rad),
        velocity_error_max_rad_s=_known(figures.velocity_error_max_rad_s),
        disturbance_error_rms_rad_s2=_known(figures.disturbance_error_rms_rad_s2),
        velocity_settled_s=settled_from(columns["time_s"], velocity_error, _SETTLED_ERROR_MAX_RAD_S),
        voltage_peak_V=_known(figures.voltage_peak_V),
        damping=damping(result.rig),
    )


def settled_from(time: NDArray[np.float64], error: NDArray[np.float64], below: float) -> float:
    """Return the time from which |error| stays below a bound for good, NaN if it never does.

    Parameters
    ----------
    time, error
        Shape (n,); `time` in s, `error` in the unit of `below`.
    """
    outside = np.flatnonzero(~(np.abs(error) < below))
    first = int(outside[-1]) + 1 if len(outside) else 0
    return float(time[first]) if first < len(time) else math.nan


def damping(rig: Rig) -> float:
    """Return the damping coefficient of a rig's closed loop, kd / (2 sqrt(kp)) as in section III.C.

    kp and kd are not read from the rig but asked of its controller, by moving position and velocity by one
    unit each: x'' = -f0 x' + (ku/J) V then shows what really acts, with any factor in front.
    """
    controller, model = make_controller(rig), rig.model.values()
    at_rest = Reference(0.0, 0.0, 0.0)
    still, moved, moving = (
        model.ku * controller.update(at_rest, Estimate(x1, x2, 0.0)) - model.f0 * x2
        for x1, x2 in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    )
    return (still - moving) / (2.0 * math.sqrt(still - moved))


def _known(figure: float | None) -> float:
    return math.nan if figure is None else figure
