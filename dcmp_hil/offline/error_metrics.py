"""The figures of a replay: how far velocity and disturbance were from the zero-phase reference."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.offline.recording import LoggedSignals
    from dcmp_hil.offline.zero_phase import ZeroPhase

_ROUNDING_RAD_S2 = 1e-12  # rad/s2: what rounding leaves of a constant


class Estimates(NamedTuple):
    """Estimates of the observer, one for each row.

    Parameters
    ----------
    position, velocity, disturbance
        rad, rad/s, rad/s2, shape (n,).
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    disturbance: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Figures for `--json`; the names are its keys. None is null: not present, or not defined."""

    velocity_error_rms_rad_s: float
    """Observer's velocity against the reference."""
    velocity_error_max_rad_s: float
    given_velocity_error_rms_rad_s: float | None
    """The same for the velocity column of the file, if it has one."""
    given_velocity_error_max_rad_s: float | None
    disturbance_rms_rad_s2: float
    """Of the estimate itself, not of its error."""
    disturbance_mean_rad_s2: float
    disturbance_error_rms_rad_s2: float
    """Against x'' + f0 x' - u of the reference; mostly the estimate's lag."""
    disturbance_sin_correlation: float | None
    """With -sin(position): near 1 where gravity is the disturbance and position 0 hangs at rest."""
    lost_samples: int
    """Sum of round(dt / T) - 1."""
    restarts: int
    """Gaps of more than ten periods and other breaks, after each of which the observer began anew."""
    rows: int
    rows_left_out: int
    """Of the file: without a number that is needed, there twice, or where no arm can have been."""
    rows_judged: int
    duration_s: float
    period_median_s: float
    period_max_s: float
    period_s: float
    """The nominal T that the observer was tuned for."""
    counts_per_rev: float | None
    """Given or estimated; null for an ideal encoder."""
    mu0_rad_s: float | None
    """Bandwidth floor used; null where the observer has none."""
    window_s: tuple[float, float]
    """First and last row judged, from the first row of the file."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values under the names above, for JSON."""
        return asdict(self)


def sampling(recording: LoggedSignals, period: float, begins: NDArray[np.bool_]) -> dict[str, Any]:
    """Describe the sampling: the part of `Figures` that needs no observer.

    Parameters
    ----------
    recording
        Its time counts.
    period
        s, the nominal T.
    begins
        Shape (n,): where the observer begins anew.
    """
    time = recording.time
    steps = np.diff(time)
    return {
        # Summed before it is cut at 0: a late sample makes one long step and one short one, and none is lost.
        "lost_samples": max(0, int(np.sum(np.round(steps / period) - 1.0))),
        "restarts": int(np.count_nonzero(begins[1:])),
        "rows": len(time),
        "rows_left_out": recording.left_out,
        "duration_s": float(time[-1] - time[0]),
        "period_median_s": float(np.median(steps)),
        "period_max_s": float(np.max(steps)),
        "period_s": period,
    }


def judge(
    recording: LoggedSignals, estimates: Estimates, reference: ZeroPhase, judged: NDArray[np.bool_]
) -> dict[str, Any]:
    """Compare with the reference: the part of `Figures` that the observer answers for.

    Parameters
    ----------
    recording, estimates, reference
        Columns of shape (n,).
    judged
        Shape (n,): the rows that count, at least one.
    """
    error = (estimates.velocity - reference.velocity)[judged]
    given = None if recording.velocity is None else (recording.velocity - reference.velocity)[judged]
    if given is not None:
        given = given[np.isfinite(given)]
        given = given if len(given) else None
    w = estimates.disturbance[judged]
    window = recording.time[judged][[0, -1]] - recording.time[0]
    return {
        "velocity_error_rms_rad_s": _rms(error),
        "velocity_error_max_rad_s": _largest(error),
        "given_velocity_error_rms_rad_s": None if given is None else _rms(given),
        "given_velocity_error_max_rad_s": None if given is None else _largest(given),
        "disturbance_rms_rad_s2": _rms(w),
        "disturbance_mean_rad_s2": float(np.mean(w)),
        "disturbance_error_rms_rad_s2": _rms(w - reference.disturbance[judged]),
        "disturbance_sin_correlation": _correlation(w, -np.sin(recording.position[judged])),
        "rows_judged": int(np.count_nonzero(judged)),
        "window_s": (float(window[0]), float(window[1])),
    }


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _largest(values: NDArray[np.float64]) -> float:
    return float(np.max(np.abs(values)))


def _correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float | None:
    """Pearson's; None if one of the two does not change."""
    a, b = a - np.mean(a), b - np.mean(b)
    size = _rms(a) * _rms(b)
    return float(np.mean(a * b) / size) if size > _ROUNDING_RAD_S2 else None
