"""Running an observer over a recording, and judging it by the zero-phase reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.error_metrics import Estimates, Figures, judge, sampling
from dcmp_hil.offline.plausibility import check_assumed, check_estimates, check_motion
from dcmp_hil.offline.preparation import prepare
from dcmp_hil.offline.settings import ReplaySettings
from dcmp_hil.offline.zero_phase import ZeroPhase, zero_phase
from dcmp_hil.plugins.checked import failure_of
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.control.observers import Observer
    from dcmp_hil.offline.recording import LoggedSignals

_RESTART_PERIODS = GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS  # the observers restart after a longer gap
_ROUNDING_S = 1e-6  # s: the row at `start` itself stays out, however the file writes its time
_ESTIMATE_MAX = 1e100  # rad, rad/s, rad/s2: squared, it still is a number


@dataclass(frozen=True, kw_only=True)
class ReplayResult:
    """Result of a replay; arrays have one value a row.

    Parameters
    ----------
    recording
        What was replayed.
    applied
        N m or V, shape (n,): the input over the step that ended at the row, by `input_at`.
    estimates
        Position, velocity and disturbance.
    reference
        Zero-phase velocity and disturbance.
    judged
        Shape (n,): the rows that the figures count.
    figures
        The figures.
    notes
        What else the reader should know, one sentence each.
    """

    recording: LoggedSignals
    applied: NDArray[np.float64]
    estimates: Estimates
    reference: ZeroPhase
    judged: NDArray[np.bool_]
    figures: Figures
    notes: tuple[str, ...]

    def has_other_reference(self, other: ReplayResult) -> bool:
        """Return whether its disturbance is judged by another reference: that of another f0 or ku."""
        now, then = self.reference.disturbance, other.reference.disturbance
        return not np.array_equal(now, then, equal_nan=True)


def replay(recording: LoggedSignals, settings: ReplaySettings | None = None) -> ReplayResult:
    """Run an observer over a recording with the measured steps.

    Lost samples are longer steps. A gap of more than ten periods restarts the observer at rest where the arm
    then is; the `start` seconds after it are left out of the figures, like those after the first row.

    Parameters
    ----------
    recording
        From `read_recording`, or made from arrays.
    settings
        The observer's parameters and how to judge; defaults otherwise.

    Raises
    ------
    ConfigError
        If the input is a torque and no inertia is given, the observer is unknown or runs away, scipy is
        missing, or nothing is left to judge.
    """
    settings = settings or ReplaySettings()
    try:
        return _replayed(recording, settings)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise ConfigError(
            f"{recording.name}: its numbers, or the gains, are beyond what the observer can compute with "
            f"({error}). Check the units, or write usual gains."
        ) from None


def _replayed(recording: LoggedSignals, settings: ReplaySettings) -> ReplayResult:
    set_up = prepare(recording, settings)
    period, gap = set_up.setting.period, _RESTART_PERIODS * set_up.setting.period
    begins = recording.begins(gap)
    reference = zero_phase(
        recording.time,
        recording.position,
        set_up.setting.model.ku * set_up.voltage,
        period=period,
        f0=settings.friction,
        begins=begins,
        cutoff=settings.cutoff,
    )
    settled = _since_restart(recording.time, begins) > settings.start + _ROUNDING_S
    judged = settled & np.isfinite(reference.velocity)
    if not judged.any():
        raise ConfigError(
            f"{recording.name}: no row is left to judge after the first {settings.start:g} s, and as long "
            f"after every gap of more than {gap:g} s. "
            "Check --time-unit, record longer, or write a smaller --from."
        )
    check_motion(recording, reference, judged)
    check_assumed(recording, reference, set_up.setting.model.ku * set_up.voltage, judged)
    estimates = _run(set_up.observer, recording, set_up.voltage, gap)
    check_estimates(recording, estimates, reference, judged)
    return ReplayResult(
        recording=recording,
        applied=set_up.applied,
        estimates=estimates,
        reference=reference,
        judged=judged,
        figures=Figures(
            **sampling(recording, period, begins),
            **judge(recording, estimates, reference, judged),
            counts_per_rev=set_up.setting.counts_per_rev,
            mu0_rad_s=set_up.observer.mu0 if isinstance(set_up.observer, SuperTwisting) else None,
        ),
        notes=recording.notes + set_up.notes,
    )


def _since_restart(time: NDArray[np.float64], begins: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return how long the observer has been running at each row, s."""
    return time - time[np.maximum.accumulate(np.where(begins, np.arange(len(time)), 0))]


def _run(observer: Observer, recording: LoggedSignals, voltage: NDArray[np.float64], gap: float) -> Estimates:
    """Run the line without a loop: one sample a row, its time counted from the first row.

    At a break the observer is shown a gap, so that it begins anew as it does after a real one.
    """
    elapsed = recording.time - recording.time[0]
    for row in recording.breaks:
        elapsed[row:] += 2.0 * gap
    rows = np.empty((len(elapsed), len(Estimate._fields)))
    samples = zip(elapsed.tolist(), recording.position.tolist(), voltage.tolist(), strict=True)
    for k, (t, position, applied) in enumerate(samples):
        rows[k] = observer.update(Sample(t, position, applied))
    away = np.flatnonzero(~(np.abs(rows) < _ESTIMATE_MAX).all(axis=1))
    if len(away):
        failure = failure_of(observer)
        if failure is not None and failure.reason == "plugin":
            raise ConfigError(f"{recording.name}, row {away[0] + 1}: {failure.error()}") from failure.cause
        raise ConfigError(
            f"{recording.name}: the observer runs away at row {away[0] + 1}. Check the units and the inertia "
            "(or ku), or write smaller gains."
        )
    return Estimates(*rows.T)
