"""Running an observer over a recording, and judging it by the zero-phase reference."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from dcmp_hil.errors import ConfigError
from dcmp_hil.model import Model
from dcmp_hil.observers import Setting
from dcmp_hil.observers.paper import PaperObserver
from dcmp_hil.observers.super_twisting import SuperTwisting
from dcmp_hil.plugins import find_named
from dcmp_hil.replay.figures import Figures, judge
from dcmp_hil.replay.reference import ZeroPhase, zero_phase
from dcmp_hil.replay.resolution import estimate_counts_per_rev
from dcmp_hil.replay.settings import IDEAL, ReplaySettings
from dcmp_hil.values import Sample

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from dcmp_hil.observers import Observer
    from dcmp_hil.replay.recording import Recording

_LONGEST_GAP = 10.02  # periods: both observers restart after a longer one
_KINDS = ("super_twisting", "paper")


@dataclass(frozen=True, kw_only=True)
class ReplayResult:
    """What the observer made of a recording; arrays have one value a row.

    Parameters
    ----------
    recording
        What was replayed.
    applied
        N m or V, shape (n,): the input over the step that ended at the row, by `input_at`.
    position, velocity, disturbance
        Estimates, rad, rad/s, rad/s2, shape (n,).
    reference
        Zero-phase velocity and disturbance.
    judged
        Shape (n,): the rows that the figures count.
    figures
        The figures.
    notes
        What else the reader should know, one sentence each.
    """

    recording: Recording
    applied: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    disturbance: NDArray[np.float64]
    reference: ZeroPhase
    judged: NDArray[np.bool_]
    figures: Figures
    notes: tuple[str, ...]


def replay(recording: Recording, settings: ReplaySettings | None = None) -> ReplayResult:
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
    gain = _gain(recording, settings)
    period = float(np.median(np.diff(recording.time))) if settings.period is None else settings.period
    counts, how = _resolution(recording, settings)
    setting = Setting(Model(f0=settings.f0, ku=1.0), period, counts)
    observer = _make(settings, setting)
    applied = _over_the_step_before(recording.input, settings)
    reference = zero_phase(
        recording.time,
        recording.position,
        gain * applied,
        period=period,
        f0=settings.f0,
        longest_gap=_LONGEST_GAP * period,
        cutoff=settings.cutoff,
    )
    judged = _judged(recording.time, _LONGEST_GAP * period, settings.start) & np.isfinite(reference.velocity)
    if not judged.any():
        raise ConfigError(
            f"{recording.name}: no row is left to judge after the first {settings.start:g} s "
            f"(and as long after every gap). Record longer, or write a smaller --from."
        )
    estimates = _run(observer, recording, gain * applied)
    figures = judge(
        recording,
        estimates,
        reference,
        judged,
        period=period,
        counts=counts,
        mu0=observer.mu0 if isinstance(observer, SuperTwisting) else None,
        restarts=int(np.count_nonzero(np.diff(recording.time) > _LONGEST_GAP * period)),
    )
    notes = (*recording.notes, *how, *_doubts(figures, settings))
    return ReplayResult(
        recording=recording,
        applied=applied,
        position=estimates[0],
        velocity=estimates[1],
        disturbance=estimates[2],
        reference=reference,
        judged=judged,
        figures=figures,
        notes=notes,
    )
