"""Carrying a replay out: read, run, write, show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.table import Table
from rich.text import Text

from dcmp_hil.cli import console
from dcmp_hil.cli.outputs import free_name, json_place, try_places, write_each
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import read_recording, replay, write_csv, write_rrd

if TYPE_CHECKING:
    from dcmp_hil.offline import ColumnOptions, ReplayResult, ReplaySettings


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


def execute(file: Path, columns: ColumnOptions, settings: ReplaySettings, outputs: Outputs) -> None:
    """Replay a file, then write and show what came of it.

    Raises
    ------
    ConfigError
        As `read_recording` and `replay`; or if a file would overwrite the recording or cannot be written.
    """
    csv, rrd = _targets(file, outputs)
    result = replay(read_recording(file, columns), settings)
    if rrd is not None and outputs.rrd is None and (reason := _no_library()):
        console.warn(f"no {rrd}: {reason}")
        rrd = None
    json = json_place(outputs.json)
    written, faults = write_each(
        [
            (csv, lambda path: write_csv(result, path)),
            (rrd, lambda path: write_rrd(result, path)),
            (json, lambda path: console.write_json(str(path), _figures(result))),
        ]
    )
    _show(file, settings, result, outputs)
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


def _show(file: Path, settings: ReplaySettings, result: ReplayResult, outputs: Outputs) -> None:
    for column in result.recording.columns:
        console.note(str(column))
    for sentence in result.notes:
        console.note(sentence)
    if outputs.json == "-":
        console.write_json("-", _figures(result))
    else:
        console.out.print(_table(file, settings, result))


def _figures(result: ReplayResult) -> dict[str, Any]:
    """Return what `--json` writes: the figures, what was read from where, and the notes."""
    columns = [str(column) for column in result.recording.columns]
    return {**result.figures.to_dict(), "columns": columns, "notes": list(result.notes)}


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


def _table(file: Path, settings: ReplaySettings, result: ReplayResult) -> Table:
    figures = result.figures
    first, last = figures.window_s
    table = Table(
        title=Text(f"{file.name}: {settings.kind}, {first:.2f} to {last:.2f} s"),
        title_justify="left",
        show_header=False,
        box=None,
        padding=(0, 2, 0, 0),
    )
    table.add_column()
    table.add_column(justify="right", style="bold")
    table.add_column(style="dim")
    against = f"{settings.cutoff:g} Hz zero phase"
    periods = f"{1e3 * figures.period_median_s:.4g} / {1e3 * figures.period_max_s:.4g}"
    gaps = f"{figures.lost_samples}, {figures.restarts}"
    counts = "ideal" if figures.counts_per_rev is None else f"{figures.counts_per_rev:.0f}"
    for what, value, unit in (
        ("velocity error, RMS", _number(figures.velocity_error_rms_rad_s), f"rad/s, {against}"),
        ("velocity error, max", _number(figures.velocity_error_max_rad_s), "rad/s"),
        ("velocity in the file, RMS error", _number(figures.given_velocity_error_rms_rad_s), "rad/s"),
        ("velocity in the file, max error", _number(figures.given_velocity_error_max_rad_s), "rad/s"),
        ("disturbance, RMS", _number(figures.disturbance_rms_rad_s2), "rad/s²"),
        ("disturbance, mean", _number(figures.disturbance_mean_rad_s2), "rad/s²"),
        ("disturbance error, RMS", _number(figures.disturbance_error_rms_rad_s2), f"rad/s², {against}"),
        ("disturbance with -sin(position)", _number(figures.disturbance_sin_correlation), "correlation"),
        ("rows, judged", f"{figures.rows}, {figures.rows_judged}", f"in {figures.duration_s:.4g} s"),
        ("rows left out", f"{figures.rows_left_out}", "the notes say why"),
        ("lost samples, restarts", gaps, "gaps above 10 periods, clock set back"),
        ("period, median / max", periods, "ms"),
        ("counts per revolution", counts, ""),
        ("mu0", _number(figures.mu0_rad_s), "rad/s"),
    ):
        table.add_row(what, value, unit)
    return table


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.4g}"
