"""Observers side by side over a recording of another program."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.comparison.cost import observer_costs
from dcmp_hil.comparison.table import (
    ComparedObserver,
    ComparedRows,
    ComparisonReference,
    ObserverComparison,
    compare_observers,
)
from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS
from dcmp_hil.offline.preparation import prepare

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.offline.run import ReplayResult
    from dcmp_hil.offline.settings import ReplaySettings

_GAP_PERIODS = GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS


def compare_in_file(replays: Mapping[str, tuple[ReplaySettings, ReplayResult]]) -> ObserverComparison:
    """Compare replays of one recording, with observers that have one model.

    Parameters
    ----------
    replays
        Settings and result, by the name of the observer; at least one. All are judged by the reference and
        the rows of the first.
    """
    settings, base = next(iter(replays.values()))
    recording, period = base.recording, base.figures.period_s
    rows = ComparedRows(
        recording.time - recording.time[0],
        base.judged,
        recording.begins(_GAP_PERIODS * period),
        period,
        settings.cutoff,
    )
    observers = [
        ComparedObserver(
            name=name, velocity=result.estimates.velocity, disturbance=result.estimates.disturbance
        )
        for name, (_, result) in replays.items()
    ]
    reference = ComparisonReference(
        kind="zero_phase", velocity=base.reference.velocity, disturbance=base.reference.disturbance
    )
    set_up = prepare(recording, settings)
    sections = {name: one.section for name, (one, _) in replays.items()}
    samples = tuple(column[rows.used] for column in (rows.time, recording.position, set_up.voltage))
    costs = observer_costs(sections, set_up.setting, settings.folders, samples)
    return compare_observers(rows, observers, reference, costs)
