"""Commands for a run's own recording: export it, run it again."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table
from rich.text import Text

from dcmp_hil.cli import console, unrepeated_changes
from dcmp_hil.cli.comparison_table import comparison_table
from dcmp_hil.cli.outputs import json_place, try_places, write_each
from dcmp_hil.cli.repeated_run import figures_of, repetitions, side_by_side
from dcmp_hil.common.number_range import number
from dcmp_hil.errors import ConfigError, IncompleteError
from dcmp_hil.recording import export
from dcmp_hil.recording.reader import read_run, recording_in
from dcmp_hil.recording.untrusted import named_in

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from dcmp_hil.cli.execute_replay import Outputs
    from dcmp_hil.cli.repeated_run import Repetition
    from dcmp_hil.cli.replay_options import ReplayOptions
    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.recording.reexecute import Reexecution

_COLUMN_WIDTH_MIN = 9  # characters


@np.errstate(all="ignore")  # a file may hold any number, and what comes of it is written as it is
def write_exports(
    file: Path, *, csv: Path | None, parquet: Path | None, rrd: Path | None, force: bool
) -> None:
    """Write the exports that the command line asks for.

    Raises
    ------
    ConfigError
        If nothing was, a file is there already, or would overwrite the recording.
    IncompleteError
        If the recording lacks something; what is right is written.
    """
    targets = [(csv, export.to_csv), (parquet, export.to_parquet), (rrd, export.to_rrd)]
    if not any(path for path, _ in targets):
        raise ConfigError("Nothing to write: say --csv FILE, --parquet FILE or --rrd FILE.")
    places = {"--csv": csv, "--parquet": parquet, "--rrd": rrd}
    try_places(places, {"the recording": recording_in(file)}, force=force)
    run = _read(file)
    for key, kind in named_in(run.rig).items():
        console.note(f'the rig in it names {key} = "{kind}", which was not imported')
    written, faults = write_each([(path, partial(write, run)) for path, write in targets])
    for path in written:
        console.note(f"wrote {path}")
    _end(run, faults)


@np.errstate(all="ignore")
def replay_own(file: Path, options: ReplayOptions, outputs: Outputs, *, trust: bool) -> None:
    """Run observer and controller over a recording again, and compare.

    Raises
    ------
    ConfigError
        If the recording cannot be read, an option says what a run knows itself, or an override is none of
        observer, controller or model.
    """
    run, start = _opened(file, options, outputs)
    keys, json_file = options.keys(), json_place(outputs.json)
    base, variants = repetitions(run, options, keys, start, trust=trust)
    others = {one.label: one.again for one in variants}
    comparison = side_by_side(run, base, variants, start, trust=trust)
    figures = figures_of(base, variants)
    if comparison is not None:
        figures["comparison"] = comparison.to_dict()
    written, faults = write_each(
        [
            (outputs.csv, partial(export.reexecution_to_csv, run, base.again, others)),
            (outputs.rrd, partial(export.reexecution_to_rrd, run, base.again, others)),
            (json_file, lambda path: console.write_json(str(path), figures)),
        ]
    )
    if outputs.json == "-":
        console.write_json("-", figures)
    else:
        console.out.print(_table(run, base, variants))
        if comparison is not None:
            console.out.print(comparison_table(comparison))
    for path in written:
        if path != json_file:
            console.note(f"wrote {path}")
    _end(run, faults)
    if not keys:
        _check_repeated(run, base.again)


def _opened(file: Path, options: ReplayOptions, outputs: Outputs) -> tuple[RecordedRun, float]:
    """Return the recording, and the time from its first period at which the figures begin, s.

    Raises
    ------
    ConfigError, IncompleteError
        If an option is none of a run's, a file cannot be written, or there is nothing to replay.
    """
    refused = options.refused_of_a_run()
    if refused:
        raise ConfigError(
            f"{', '.join(refused)}: for a CSV file only; a run of dcmp-hil knows its columns, units, "
            "sampling and rig. Leave it out. Other gains: --observer, --mu0, --M, --L1, --L2, --f0, --ku, "
            "--set KEY=VALUE."
        )
    places = {"--csv": outputs.csv, "--rrd": outputs.rrd, "--json": json_place(outputs.json)}
    try_places(places, {"the recording": recording_in(file)}, force=outputs.force)
    run = _read(file)
    if not len(run.rows):
        raise _incomplete(run) if run.damage else ConfigError(f"{run.path}: no period is in it.")
    _tell_faults(run)
    start = options.figures.get("start") or 0.0
    lasted = float(run.rows[-1, 0] - run.rows[0, 0])
    if start and not 0.0 <= start < lasted:
        raise ConfigError(f"--from: got {number(start)} s; the run lasts {lasted:.4g} s. Write less.")
    return run, start


def _check_repeated(run: RecordedRun, again: Reexecution) -> None:
    """Check that a repetition with the run's own rig made all of its changes.

    Raises
    ------
    IncompleteError
        If not.
    """
    refused = unrepeated_changes.refused(again.unrepeated)
    if refused:
        raise IncompleteError(
            f"{run.path}: {len(refused)} of its changes cannot be repeated: the warnings say which. What was "
            "made of it is without them."
        )


def _read(file: Path) -> RecordedRun:
    """Read a recording; tell what is wrong with it before anything is made of it."""
    run = read_run(file)
    for sentence in (*run.damage, *run.unchecked):
        console.warn(f"{run.path}: {sentence}.")
    return run


def _end(run: RecordedRun, faults: Sequence[str]) -> None:
    """End with the code that says what could not be written, or what the recording lacks.

    Raises
    ------
    ConfigError, IncompleteError
        If so, after everything that can be written was.
    """
    if faults:
        raise ConfigError(*faults)
    if run.damage:
        raise _incomplete(run)


def _incomplete(run: RecordedRun) -> IncompleteError:
    return IncompleteError(
        f"{run.path} is incomplete or damaged: the warnings say where. What was made of it holds the "
        f"{len(run.rows)} periods that are right."
    )


def _tell_faults(run: RecordedRun) -> None:
    """Warn where the run was told to go wrong in observer or controller, which are sound here."""
    if '"host.' in run.run.get("faults", ""):
        console.warn(
            f"{run.path} had faults of the host on purpose. Here observer and controller have none: the "
            "numbers may differ from where a fault began."
        )


def _table(run: RecordedRun, base: Repetition, variants: Sequence[Repetition]) -> Table:
    """Return the table of the run, its repetition, and the variants that no list of observers names."""
    others = [one for one in variants if not one.observer]
    said = "every number is the same, to the bit" if base.result.identical else "the numbers differ"
    table = Table(
        title=Text(f"{run.path}: {base.result.rows} periods again: {said}"),
        title_justify="left",
        box=None,
        padding=(0, 2, 0, 0),
    )
    least = _COLUMN_WIDTH_MIN if others else None  # a label folds, a number does not
    table.add_column("", no_wrap=True)
    table.add_column("recorded", justify="right", overflow="fold")
    for label in (base.label or "again", *(one.label for one in others)):
        table.add_column(Text(label), justify="right", style="bold", overflow="fold", min_width=least)
    again = [[line.again for line in one.result.figures] for one in (base, *others)]
    for line, *values in zip(base.result.figures, *again, strict=True):
        table.add_row(line.name, _number(line.recorded), *map(_number, values))
    return table


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
