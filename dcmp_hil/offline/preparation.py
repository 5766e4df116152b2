"""Preparation of a replay: its observer, the rig's model, and the input."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.config.stage_factory import observer_of
from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.resolution import equivalent_counts_per_rev, estimate_counts_per_rev
from dcmp_hil.offline.settings import IDEAL, ReplaySettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.control.observers import Observer
    from dcmp_hil.offline.recording import LoggedSignals

_PERIOD_MIN_S = 1e-6  # s: a shorter period is a wrong unit
_USUAL_COUNTS = 4096.0  # where the recording tells nothing


class Preparation(NamedTuple):
    """Observer, model and settings of a replay, fixed before the first row.

    Parameters
    ----------
    observer
        Fresh.
    setting
        What it knows of the rig. A torque has no volts: there ku is 1.
    applied
        N m or V, shape (n,): the input over the step that ends at each row.
    voltage
        Shape (n,): what the samples carry as their voltage, V, or torque / J in rad/s2.
    notes
        What else the reader should know, one sentence each.
    """

    observer: Observer
    setting: ObserverContext
    applied: NDArray[np.float64]
    voltage: NDArray[np.float64]
    notes: tuple[str, ...]


def prepare(recording: LoggedSignals, settings: ReplaySettings) -> Preparation:
    """Settle what the settings leave open, from the recording.

    Raises
    ------
    ConfigError
        If an inertia is missing, the period is none, or the observer cannot be made.
    """
    ku, per_input, why = _gains(recording, settings)
    period = _period(recording, settings)
    counts, how = _resolution(recording, settings)
    notes = why + how
    setting = ObserverContext(settings.model._replace(f0=settings.friction, ku=ku), period, counts)
    observer = observer_of(settings.section, setting, settings.folders, "--observer")
    if isinstance(observer, SuperTwisting) and observer.mu0 * period > 0.3 + 1e-9:
        most = 0.3 / period
        notes += (f"mu0 = {observer.mu0:g} rad/s is more than the rule ever takes here ({most:.3g} rad/s).",)
    applied = _over_the_step_before(recording.input, settings)
    return Preparation(observer, setting, applied, per_input * applied, notes)


def _gains(recording: LoggedSignals, settings: ReplaySettings) -> tuple[float, float, tuple[str, ...]]:
    """Return the model's ku, what the input is multiplied by to be the voltage of a sample, and notes."""
    if recording.input_kind == "none":
        return settings.model.ku if settings.ku is None else settings.ku, 1.0, ()
    if recording.input_kind == "voltage" and settings.ku is None:
        ku = settings.model.ku
        if ku != Model().ku:
            return ku, 1.0, ()
        return ku, 1.0, (f"ku = {ku:g} (rad/s2)/V is the paper's motor. --ku says what yours is.",)
    if recording.input_kind == "voltage" and settings.ku is not None:
        return settings.ku, 1.0, ()
    if settings.inertia is None:
        raise ConfigError(
            f"{recording.name}: the input is a torque, which acts as torque / J. Give the inertia about the "
            "axis in kg m2: --inertia J (about m l^2 for an arm with its mass at the end)."
        )
    return 1.0, 1.0 / settings.inertia, ()


def _period(recording: LoggedSignals, settings: ReplaySettings) -> float:
    if settings.period is not None:
        return settings.period
    period = float(np.median(np.diff(recording.time)))
    if period < _PERIOD_MIN_S:
        raise ConfigError(
            f"{recording.name}: a usual step of {period:g} s is too short to be one. "
            "Check the time column and its unit (--time, --time-unit)."
        )
    return period


def _resolution(recording: LoggedSignals, settings: ReplaySettings) -> tuple[float | None, tuple[str, ...]]:
    """Return the counts a revolution that the rules of mu0 and M go by, and where they come from."""
    if settings.counts_per_rev == IDEAL:
        return None, ()
    if settings.counts_per_rev is not None:
        return float(settings.counts_per_rev), ()
    counts = estimate_counts_per_rev(recording.position)
    if counts is not None:
        why = f"estimated from the smallest position step, {2.0 * math.pi / counts:.4g} rad"
    else:
        counts = equivalent_counts_per_rev(recording.position)
        why = "no encoder step is visible; an encoder of so many would scatter alike"
    if counts is None:
        counts, why = _USUAL_COUNTS, "assumed, since the position hardly changes"
    return counts, (f"Counts per revolution: {counts:.0f} ({why}). --counts-per-rev overrides it.",)


def _over_the_step_before(values: NDArray[np.float64], settings: ReplaySettings) -> NDArray[np.float64]:
    """Shift the input to the row that its step ends at; the first row ends none and keeps its own."""
    return values if settings.input_at == "end" else np.concatenate((values[:1], values[:-1]))
