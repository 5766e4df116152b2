"""A recorded run again, with other keys and with other observers: what came of each."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil.cli import console, unrepeated_changes
from dcmp_hil.cli.replay_options import keys_of
from dcmp_hil.comparison import ObserverBeside, compare_in_run
from dcmp_hil.config import load_table
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.compare import compare
from dcmp_hil.recording.reexecute import reexecute

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from dcmp_hil.cli.replay_options import ReplayOptions
    from dcmp_hil.cli.replay_variants import Variant
    from dcmp_hil.comparison import ObserverComparison
    from dcmp_hil.config import Rig
    from dcmp_hil.recording.compare import Comparison
    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.recording.reexecute import Reexecution

_MAY_CHANGE = ("observer", "controller", "model")


class Repetition(NamedTuple):
    """A repetition of a run.

    Parameters
    ----------
    label
        What is other than in the run, in one text; empty for nothing.
    rig
        What was run again.
    again
        What observer and controller said.
    result
        The comparison with the run.
    observer
        Its kind, where a list of observers names it; else empty.
    """

    label: str
    rig: Rig
    again: Reexecution
    result: Comparison
    observer: str = ""


def repetitions(
    run: RecordedRun, options: ReplayOptions, keys: Sequence[str], start: float, *, trust: bool
) -> tuple[Repetition, list[Repetition]]:
    """Run it again with the overrides of `keys`, and with each variant; tell what is not repeated of it.

    Parameters
    ----------
    run
        The recording.
    options
        Their variants count.
    keys
        Overrides.
    start
        s from the first period; the figures count what is not earlier.
    trust
        As for `reexecute`.

    Raises
    ------
    ConfigError
        As `reexecute`; a fault names its variant.
    """
    changed = _changed(run.rig, keys, trust=trust)
    rig = changed or run.rig
    again = reexecute(run, changed, pinned=keys_of(keys), trust=trust)
    base = Repetition(" ".join(keys), rig, again, compare(run, again, start))
    others = []
    for variant in options.compared(rig, _MAY_CHANGE):
        other = _repeated(run, variant, keys_of((*keys, *variant.overrides)), trust=trust)
        result = compare(run, other, start)
        others.append(Repetition(variant.label, variant.tables, other, result, variant.observer))
    unrepeated_changes.tell(base.label or str(run.path), again.unrepeated)
    for one in others:
        unrepeated_changes.tell(one.label, one.again.unrepeated)
    return base, others


def side_by_side(
    run: RecordedRun, base: Repetition, others: Sequence[Repetition], start: float, *, trust: bool
) -> ObserverComparison | None:
    """Return the comparison of the observers of a list; None where no list names another one.

    The observer that closed the loop comes first, as it was recorded; then the repetition with other keys,
    if there are any.
    """
    beside = {one.observer: _beside(one) for one in others if one.observer}
    if not beside:
        return None
    if base.label:
        beside = {base.label: _beside(base), **beside}
    name = "recorded" if base.label else run.rig.observer.kind
    columns = run.columns
    comparison = compare_in_run(run.rig, columns, beside, columns["time_s"][0] + start, name, trust=trust)
    for note in comparison.notes:
        console.note(note)
    return comparison


def _beside(one: Repetition) -> ObserverBeside:
    _, velocity, disturbance = one.again.estimate.T
    return ObserverBeside(velocity, disturbance, one.again.demand, one.rig.observer)


def figures_of(base: Repetition, others: Sequence[Repetition]) -> dict[str, Any]:
    """Return what `--json` writes: the figures of the run and of each repetition."""
    lines = {line.name: {"recorded": line.recorded, "again": line.again} for line in base.result.figures}
    found = {
        "identical": base.result.identical,
        "rows": base.result.rows,
        "unrepeated_changes": unrepeated_changes.document(base.again.unrepeated),
        **lines,
    }
    compared = [
        {
            "set": one.label,
            "identical": one.result.identical,
            "unrepeated_changes": unrepeated_changes.document(one.again.unrepeated),
            **{line.name: line.again for line in one.result.figures},
        }
        for one in others
    ]
    return {**found, "compared": compared} if compared else found


def _repeated(
    run: RecordedRun, variant: Variant[Rig], pinned: Collection[str], *, trust: bool
) -> Reexecution:
    """Run a variant of `--compare`; a fault names it."""
    rig = variant.tables.in_folder(run.rig.folder if trust else None)
    try:
        return reexecute(run, rig, pinned=pinned, trust=trust)
    except ConfigError as error:
        faults = (f"--compare {variant.label}: {fault}" for fault in error.faults)
        raise ConfigError(*faults) from error.__cause__


def _changed(rig: Rig, overrides: Sequence[str], *, trust: bool) -> Rig | None:
    """Return the rig with other gains; None for the same.

    Classes that the overrides name are looked for where the recording says only if it is trusted.
    """
    if not overrides:
        return None
    for override in overrides:
        if override.partition(".")[0] not in _MAY_CHANGE:
            raise ConfigError(
                f"--set {override}: what was measured stays as it was; only keys of "
                f"{', '.join(_MAY_CHANGE)} can be changed afterwards."
            )
    table = json.loads(json.dumps(rig.model_dump(mode="python", exclude_unset=True), default=str))
    return load_table(table, overrides, rig.folder if trust else None)
