"""Observers side by side over the columns of a run, or of its recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.comparison.cost import observer_costs
from dcmp_hil.comparison.table import (
    ComparedObserver,
    ComparedRows,
    ComparisonReference,
    ObserverComparison,
    compare_observers,
)
from dcmp_hil.config.compared_observers import column_name, compared_sections
from dcmp_hil.config.sections import Custom
from dcmp_hil.control.observers import GAP_PERIODS_MAX, STEP_TOLERANCE_PERIODS
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.zero_phase import zero_phase

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.config.kinds import ObserverSection
    from dcmp_hil.result import Result

    Column = NDArray[np.float64]
    Columns = Mapping[str, Column]

_GAP_PERIODS = GAP_PERIODS_MAX + STEP_TOLERANCE_PERIODS


class ObserverBeside(NamedTuple):
    """An observer that did not close the loop.

    Parameters
    ----------
    velocity, disturbance
        rad/s and rad/s2, shape (n,).
    demand
        V, shape (n,); None without any.
    section
        Its table.
    """

    velocity: Column
    disturbance: Column
    demand: Column | None
    section: ObserverSection


def compare_result(result: Result) -> ObserverComparison | None:
    """Compare the observers of a run that was asked to `compare`, in the window of its summary.

    Returns
    -------
    ObserverComparison or None
        None where nothing was compared, or there was no period. Where the columns of the run were not kept,
        over its last cycles.
    """
    columns = result.columns or result.last_columns
    if not result.compared or not columns or not len(columns["time_s"]):
        return None
    beside = shadows_in(result.rig, columns, result.compared)
    return compare_in_run(result.rig, columns, beside, result.summary.window_s[0])


def shadows_in(rig: Rig, columns: Columns, kinds: Iterable[str]) -> dict[str, ObserverBeside]:
    """Return the observers that ran beside the loop, by kind, from the columns of their run.

    Parameters
    ----------
    rig
        That was run.
    columns
        Of the run.
    kinds
        As they were asked for.
    """
    found = {}
    for kind, section in compared_sections(rig, kinds).items():
        name = column_name(kind)
        found[kind] = ObserverBeside(
            columns[f"velocity_{name}_rad_s"],
            columns[f"disturbance_{name}_rad_s2"],
            columns.get(f"voltage_demand_{name}_V"),
            section,
        )
    return found


def compare_in_run(
    rig: Rig,
    columns: Columns,
    beside: Mapping[str, ObserverBeside],
    window_from: float = 0.0,
    name: str = "",
    *,
    trust: bool = True,
) -> ObserverComparison:
    """Compare the observer that closed the loop of a run with others on the same samples.

    Errors and lag are against the truth where it is known, else against the zero-phase reference of `replay`.

    Parameters
    ----------
    rig
        That was run.
    columns
        By the names of the table of signals, shape (n,) each.
    beside
        The others, by name.
    window_from
        s, device time from which the figures count.
    name
        Of the observer that closed the loop; its kind by default.
    trust
        Whether classes of one's own may be imported, for their cost.
    """
    name = name or rig.observer.kind
    time = columns["time_s"]
    rows = ComparedRows(
        time,
        time >= window_from - 0.5 * rig.period,
        np.concatenate(([True], np.diff(time) > _GAP_PERIODS * rig.period))[: len(time)],
        rig.period,
    )
    reference, note = _reference(rig, columns, rows)
    loop = ComparedObserver(
        name=name,
        velocity=columns["velocity_estimate_rad_s"],
        disturbance=columns["disturbance_estimate_rad_s2"],
        voltage=columns["voltage_sent_V"],
        closes_loop=True,
    )
    others = [
        ComparedObserver(name=other, velocity=one.velocity, disturbance=one.disturbance, voltage=one.demand)
        for other, one in beside.items()
    ]
    sections = {name: rig.observer, **{other: one.section for other, one in beside.items()}}
    if not trust:
        sections = {label: one for label, one in sections.items() if not isinstance(one, Custom)}
    names = ("time_s", "position_rad", "voltage_applied_V")
    samples = tuple(columns[name][rows.used] for name in names)
    costs = observer_costs(sections, rig.observer_context, rig.plugin_folders, samples)
    return compare_observers(rows, [loop, *others], reference, costs).with_notes(note)


def _reference(rig: Rig, columns: Columns, rows: ComparedRows) -> tuple[ComparisonReference, str]:
    """Return what the estimates are judged by, and why it is none."""
    velocity, disturbance = columns["velocity_true_rad_s"], columns["disturbance_true_rad_s2"]
    if np.isfinite(velocity).any():
        return ComparisonReference(kind="truth", velocity=velocity, disturbance=disturbance), ""
    model = rig.model.values()
    try:
        found = zero_phase(
            rows.time,
            columns["position_rad"],
            model.ku * columns["voltage_applied_V"],
            period=rows.period,
            f0=model.f0,
            begins=rows.begins,
            cutoff=rows.cutoff,
        )
    except ConfigError as error:
        return ComparisonReference(kind="none", velocity=velocity, disturbance=disturbance), str(error)
    return ComparisonReference(kind="zero_phase", velocity=found.velocity, disturbance=found.disturbance), ""
