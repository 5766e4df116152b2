"""Carrying a replay out: read, run, write, show."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.table import Table
from rich.text import Text

from dcmp_hil.cli import console
from dcmp_hil.cli.comparison_table import comparison_table
from dcmp_hil.cli.outputs import free_name, json_place, try_places, write_each
from dcmp_hil.comparison import compare_in_file
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import read_recording, replay, write_csv, write_rrd

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from dcmp_hil.cli.replay_variants import Variant
    from dcmp_hil.comparison import ObserverComparison
    from dcmp_hil.offline import ColumnOptions, Figures, LoggedSignals, ReplayResult, ReplaySettings

_COLUMN_WIDTH_MIN = 9  # characters
_OWN_REFERENCE_NOTE = (
    "The disturbance is judged by a reference with the model of this variant, x'' + f0 x' - u, which CSV and "
    ".rrd hold beside the other one."
)


class Outputs(NamedTuple):
    """Output files of a replay.

    Parameters
    ----------
    json
        Of the figures; ``-`` for standard output, None for no output.
    csv, rrd
        Of the columns; None for the default name in the current folder.
    by_default
        Whether the default names are written at all.
    force
        Whether files that are there are overwritten.
    rig
        What `--rig` names; None where it does not.
    """

    json: str | None
    csv: Path | None
    rrd: Path | None
    by_default: bool
    force: bool = False
    rig: str | None = None


def execute(
    file: Path,
    columns: ColumnOptions,
    settings: ReplaySettings,
    outputs: Outputs,
    variants: Sequence[tuple[Variant[Any], ReplaySettings]] = (),
) -> None:
    """Replay a file, then write and show what came of it.

    Parameters
    ----------
    file, columns, settings
        As for `read_recording` and `replay`.
    outputs
        What is written.
    variants
        To be compared, each with its settings.

    Raises
    ------
    ConfigError
        As `read_recording` and `replay`; or if a file would overwrite the recording or cannot be written.
    """
    csv, rrd = _targets(file, outputs)
    recording = read_recording(file, columns)
    result = replay(recording, settings)
    compared = {
        variant.label: _compared(variant.label, recording, other, result) for variant, other in variants
    }
    comparison = _side_by_side(settings, result, compared, variants)
    document = _figures(result, compared, comparison)
    if rrd is not None and outputs.rrd is None and (reason := _no_library()):
        console.warn(f"no {rrd}: {reason}")
        rrd = None
    json = json_place(outputs.json)
    written, faults = write_each(
        [
            (csv, lambda path: write_csv(result, path, compared)),
            (rrd, lambda path: write_rrd(result, path, compared)),
            (json, lambda path: console.write_json(str(path), document)),
        ]
    )
    _tell(result, compared)
    if outputs.json == "-":
        console.write_json("-", document)
    else:
        unlisted = {one.label: compared[one.label] for one, _ in variants if not one.observer}
        console.out.print(_table(file, settings, result, unlisted))
        if comparison is not None:
            console.out.print(comparison_table(comparison))
    for path in written:
        if path != json:
            console.note(f"wrote {path}")
    if faults:
        raise ConfigError(*faults)


def _no_library() -> str:
    """Return why the library of Rerun does not load here; nothing if it does."""
    try:
        import dcmp_hil.telemetry.rerun.series  # noqa: F401
    except ImportError as error:
        return str(error)
    return ""


def _compared(
    label: str, recording: LoggedSignals, settings: ReplaySettings, base: ReplayResult
) -> ReplayResult:
    """Replay with the settings of a variant; a fault names it, and a note says what judges another model."""
    try:
        result = replay(recording, settings)
    except ConfigError as error:
        raise ConfigError(*(f"--compare {label}: {fault}" for fault in error.faults)) from error.__cause__
    if not result.has_other_reference(base):
        return result
    return dataclasses.replace(result, notes=(*result.notes, _OWN_REFERENCE_NOTE))


def _side_by_side(
    settings: ReplaySettings,
    result: ReplayResult,
    compared: Mapping[str, ReplayResult],
    variants: Sequence[tuple[Variant[Any], ReplaySettings]],
) -> ObserverComparison | None:
    """Return the comparison of the observers of a list; None where no list was given."""
    listed = {
        variant.observer: (other, compared[variant.label]) for variant, other in variants if variant.observer
    }
    if not listed:
        return None
    comparison = compare_in_file({settings.kind: (settings, result), **listed})
    for note in comparison.notes:
        console.note(note)
    return comparison


def _tell(result: ReplayResult, compared: Mapping[str, ReplayResult]) -> None:
    """Note the columns that were read, and the remarks of each replay."""
    for column in result.recording.columns:
        console.note(str(column))
    for sentence in result.notes:
        console.note(sentence)
    for label, other in compared.items():
        for sentence in other.notes:
            if sentence not in result.notes:
                console.note(f"{label}: {sentence}")


def _figures(
    result: ReplayResult, compared: Mapping[str, ReplayResult], comparison: ObserverComparison | None
) -> dict[str, Any]:
    """Return what `--json` writes: the figures, what was read from where, and the notes."""
    columns = [str(column) for column in result.recording.columns]
    found = {**result.figures.to_dict(), "columns": columns, "notes": list(result.notes)}
    others = [
        {"set": label, **other.figures.to_dict(), "notes": list(other.notes)}
        for label, other in compared.items()
    ]
    if others:
        found["compared"] = others
    return {**found, "comparison": comparison.to_dict()} if comparison else found


def _targets(file: Path, outputs: Outputs) -> tuple[Path | None, Path | None]:
    """Return the paths of CSV and .rrd; neither is the recording itself."""
    named = outputs.csv, outputs.rrd
    defaults = (Path(f"{file.stem}-replay{suffix}") for suffix in (".csv", ".rrd"))
    if not outputs.force:  # what an earlier replay left stays
        defaults = (free_name(default) for default in defaults)
    csv, rrd = (
        target or (default if outputs.by_default else None)
        for target, default in zip(named, defaults, strict=True)
    )
    places = {"--csv": csv, "--rrd": rrd, "--json": json_place(outputs.json)}
    inputs = {"the recording": file}
    if outputs.rig is not None and outputs.rig.endswith(".toml"):
        inputs["the rig"] = Path(outputs.rig)
    try_places(places, inputs, force=outputs.force)
    return csv, rrd


def _table(
    file: Path, settings: ReplaySettings, result: ReplayResult, compared: Mapping[str, ReplayResult]
) -> Table:
    first, last = result.figures.window_s
    table = Table(
        title=Text(f"{file.name}: {settings.kind}, {first:.2f} to {last:.2f} s"),
        title_justify="left",
        show_header=bool(compared),
        box=None,
        padding=(0, 2, 0, 0),
    )
    least = _COLUMN_WIDTH_MIN if compared else None  # a label folds, a number does not
    table.add_column(no_wrap=True)
    for label in (settings.kind, *compared):
        table.add_column(Text(label), justify="right", style="bold", overflow="fold", min_width=least)
    table.add_column(style="dim")
    columns = [_values(one.figures) for one in (result, *compared.values())]
    for (what, unit), *values in zip(_lines(settings, result.figures), *columns, strict=True):
        table.add_row(what, *values, unit)
    return table


def _lines(settings: ReplaySettings, figures: Figures) -> list[tuple[str, str]]:
    """Return the name of each line of the table, and what stands behind its numbers."""
    against = f"{settings.cutoff:g} Hz zero phase"
    return [
        ("velocity error, RMS", f"rad/s, {against}"),
        ("velocity error, max", "rad/s"),
        ("velocity in the file, RMS error", "rad/s"),
        ("velocity in the file, max error", "rad/s"),
        ("disturbance, RMS", "rad/s²"),
        ("disturbance, mean", "rad/s²"),
        ("disturbance error, RMS", f"rad/s², {against}"),
        ("disturbance with -sin(position)", "correlation"),
        ("rows, judged", f"in {figures.duration_s:.4g} s"),
        ("rows left out", "the notes say why"),
        ("lost samples, restarts", "gaps above 10 periods, clock set back"),
        ("period, median / max", "ms"),
        ("counts per revolution", ""),
        ("mu0", "rad/s"),
    ]


def _values(figures: Figures) -> list[str]:
    """Return the numbers of one replay, in the order of `_lines`."""
    return [
        _number(figures.velocity_error_rms_rad_s),
        _number(figures.velocity_error_max_rad_s),
        _number(figures.given_velocity_error_rms_rad_s),
        _number(figures.given_velocity_error_max_rad_s),
        _number(figures.disturbance_rms_rad_s2),
        _number(figures.disturbance_mean_rad_s2),
        _number(figures.disturbance_error_rms_rad_s2),
        _number(figures.disturbance_sin_correlation),
        f"{figures.rows}, {figures.rows_judged}",
        f"{figures.rows_left_out}",
        f"{figures.lost_samples}, {figures.restarts}",
        f"{1e3 * figures.period_median_s:.4g} / {1e3 * figures.period_max_s:.4g}",
        "ideal" if figures.counts_per_rev is None else f"{figures.counts_per_rev:.0f}",
        _number(figures.mu0_rad_s),
    ]


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.4g}"
