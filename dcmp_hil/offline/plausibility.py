"""Figures that cannot be true: better an error than a number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.offline.error_metrics import Estimates
    from dcmp_hil.offline.recording import LoggedSignals
    from dcmp_hil.offline.zero_phase import ZeroPhase

_SPEED_MAX_RAD_S = 2000.0  # rad/s, 19,000 rpm
_ERROR_RATIO_MAX = 3.0  # times the motion itself: no observer that follows it is so far off
_LARGE_SPEED_RAD_S = 20.0  # rad/s
_ACCELERATION_RATIO_MAX = 5.0  # times the largest accelerations that input and gravity explain
_GRAVITY_MAX_RAD_S2 = 50.0  # rad/s2, of an arm of 0.2 m


def check_motion(recording: LoggedSignals, reference: ZeroPhase, judged: NDArray[np.bool_]) -> None:
    """Refuse a recording that no arm and no motor can have made.

    Raises
    ------
    ConfigError
        With the options that say what the columns are.
    """
    fastest = float(np.max(np.abs(reference.velocity[judged])))
    if fastest > _SPEED_MAX_RAD_S:
        raise ConfigError(
            f"{recording.name}: by this recording the arm turns at {fastest:.4g} rad/s "
            f"({fastest * 60.0 / (2.0 * np.pi):.4g} rpm), which cannot be. Check the units (--position-unit, "
            "--counts-per-rev, --time-unit), the modulus that the position wraps at (--modulus), and "
            "--period if you gave it."
        )


def check_assumed(
    recording: LoggedSignals, reference: ZeroPhase, pushed: NDArray[np.float64], judged: NDArray[np.bool_]
) -> None:
    """Refuse a position without a unit that moves far more fiercely than input and gravity explain.

    Parameters
    ----------
    recording, reference, judged
        As for `check_motion`.
    pushed
        rad/s2, shape (n,): the acceleration by the input.

    Raises
    ------
    ConfigError
        With the option that says the unit: degrees that are taken as radians look like this.
    """
    position = next((column for column in recording.columns if column.quantity == "position"), None)
    if position is None or position.source != "assumed":
        return
    unexplained, explained = (
        float(np.sqrt(np.mean(np.square(values[judged])))) for values in (reference.disturbance, pushed)
    )
    if unexplained > _ACCELERATION_RATIO_MAX * (explained + _GRAVITY_MAX_RAD_S2):
        raise ConfigError(
            f'{recording.name}: nothing says the unit of the position "{position.column}". In rad its motion '
            f"would need {unexplained:.3g} rad/s2 that neither input nor gravity explains. Say the unit: "
            "--position-unit deg, or rad if it is."
        )


def check_estimates(
    recording: LoggedSignals, estimates: Estimates, reference: ZeroPhase, judged: NDArray[np.bool_]
) -> None:
    """Refuse figures of an observer that is further off than the motion is large.

    Raises
    ------
    ConfigError
        With the options that are likely to be wrong.
    """
    truth = reference.velocity[judged]
    error = float(np.sqrt(np.mean(np.square(estimates.velocity[judged] - truth))))
    motion = float(np.sqrt(np.mean(np.square(truth))))
    if error > max(_LARGE_SPEED_RAD_S, _ERROR_RATIO_MAX * motion):
        raise ConfigError(
            f"{recording.name}: a velocity error of {error:.4g} rad/s RMS, in a motion of {motion:.4g} rad/s "
            "RMS, is no figure of an observer. Check the units (--position-unit, --counts-per-rev, "
            "--time-unit), the modulus that the position wraps at (--modulus), the input's gain (--ku, "
            "--inertia), and the observer's gains."
        )
