"""`dcmp-hil replay`: an observer over a recording, judged by a zero-phase reference."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from dcmp_hil.cli.options import Force, JsonFile, duration_of

_COLUMNS = "Columns and units (found by name where not given)"
_FILE = "What the file does not say"
_OBSERVER = "Observer and rig"
_FIGURES = "Figures"
_OUTPUT = "Output"
_TIME = "TIME"  # with a unit, such as 2ms


class InputAt(StrEnum):
    """Which row holds the input over [k-1, k)."""

    START = "start"
    END = "end"


def _column(quantity: str, more: str = "") -> Any:
    flags = (f"--{quantity}", f"--{quantity}-column")
    return typer.Option(
        *flags, metavar="COLUMN", help=f"Column of the {quantity}{more}.", rich_help_panel=_COLUMNS
    )


def _unit(quantity: str, units: str) -> Any:
    return typer.Option(
        f"--{quantity}-unit", metavar="UNIT", help=f"Its unit: {units}.", rich_help_panel=_COLUMNS
    )


def _number(*flags: str, unit: str, text: str, panel: str = _OBSERVER) -> Any:
    parser = duration_of(flags[0]) if unit == _TIME else None
    return typer.Option(*flags, metavar=unit, help=text, rich_help_panel=panel, parser=parser)


def replay(  # noqa: PLR0913 - typer reads the options from the signature
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="CSV recording with time, position, torque or voltage; or a run of dcmp-hil."
        ),
    ],
    *,
    time: Annotated[str | None, _column("time", "; none; or seconds+nanoseconds")] = None,
    position: Annotated[str | None, _column("position")] = None,
    torque: Annotated[str | None, _column("torque", "; or none")] = None,
    voltage: Annotated[str | None, _column("voltage", "; or none")] = None,
    velocity: Annotated[str | None, _column("velocity", "; or none")] = None,
    time_unit: Annotated[str | None, _unit("time", "s, ms, us, ns")] = None,
    position_unit: Annotated[str | None, _unit("position", "rad, mrad, deg, rev, counts")] = None,
    torque_unit: Annotated[str | None, _unit("torque", "Nm, mNm, Ncm")] = None,
    voltage_unit: Annotated[str | None, _unit("voltage", "V, mV")] = None,
    velocity_unit: Annotated[str | None, _unit("velocity", "rad/s, deg/s, rev/s, rpm")] = None,
    period: Annotated[
        float | None,
        _number(
            "--period",
            unit=_TIME,
            panel=_FILE,
            text="The rows are evenly sampled, so far apart; a time column then tells only which were lost.",
        ),
    ] = None,
    no_input: Annotated[
        bool,
        typer.Option("--no-input", help="There was no input: the arm swung freely.", rich_help_panel=_FILE),
    ] = False,
    modulus: Annotated[
        str | None,
        _number(
            "--modulus",
            unit="N",
            panel=_FILE,
            text="After how many of its units the position wraps (65536 counts); or none. Default: found.",
        ),
    ] = None,
    input_at: Annotated[
        InputAt | None,
        typer.Option(
            help="Row that holds the input over [k-1, k): start = row k-1 (default), end = row k.",
            rich_help_panel=_FILE,
        ),
    ] = None,
    rig: Annotated[
        str | None,
        _number(
            "--rig", unit="RIG", text="Take observer, model and encoder from this rig. Default: the paper's."
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Override a key of the rig: observer.*, model.*. Repeatable.",
            rich_help_panel=_OBSERVER,
        ),
    ] = None,
    variants: Annotated[
        list[str] | None,
        typer.Option(
            "--compare",
            metavar="KEY=VALUE",
            help="Also with these observers (kalman,derivative), or with this key; of a run controller.*, "
            "too. Repeatable.",
            rich_help_panel=_OBSERVER,
        ),
    ] = None,
    inertia: Annotated[
        float | None,
        _number(
            "--inertia", "--J", "-J", unit="KG_M2", text="J: torque acts as torque / J. Needed with a torque."
        ),
    ] = None,
    ku: Annotated[
        float | None, _number("--ku", unit="RAD/S2/V", text="ku/J: acceleration of one volt. Default 5.4.")
    ] = None,
    counts_per_rev: Annotated[
        str | None,
        _number(
            "--counts-per-rev", "--counts", unit="N", text="Encoder, for mu0; or ideal. Default: estimated."
        ),
    ] = None,
    observer: Annotated[
        str | None,
        _number(
            "--observer", unit="NAME", text="super_twisting (default), paper, or module:Class of your own."
        ),
    ] = None,
    f0: Annotated[
        float | None, _number("--f0", unit="1/S", text="Viscous friction over inertia. Default 0.1.")
    ] = None,
    mu0: Annotated[
        float | None,
        _number(
            "--mu0", unit="RAD/S", text="Bandwidth floor of super_twisting. Default: by encoder and rate."
        ),
    ] = None,
    M: Annotated[
        float | None,
        _number("--M", unit="RAD/S3", text="Differentiator gain. Default: super_twisting 15, paper 1000."),
    ] = None,
    L1: Annotated[float | None, _number("--L1", unit="1/S", text="Copy gain. Default 4.9.")] = None,
    L2: Annotated[float | None, _number("--L2", unit="1/S2", text="Copy gain. Default 5.51.")] = None,
    window_from: Annotated[
        float | None,
        _number(
            "--from",
            unit=_TIME,
            panel=_FIGURES,
            text="Judge what is later than this, and so after every restart. Default 0.3; of a run 0.",
        ),
    ] = None,
    cutoff: Annotated[
        float | None,
        _number(
            "--cutoff", unit="HZ", panel=_FIGURES, text="Corner of the zero-phase reference. Default 15."
        ),
    ] = None,
    json_file: JsonFile = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Default: <FILE>-replay.csv here; none for a run.", rich_help_panel=_OUTPUT
        ),
    ] = None,
    rrd: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Default: <FILE>-replay.rrd here; none for a run.", rich_help_panel=_OUTPUT
        ),
    ] = None,
    no_write: Annotated[
        bool, typer.Option("--no-write", help="Write only the named files.", rich_help_panel=_OUTPUT)
    ] = False,
    force: Force = False,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust",
            help="Import the classes and read the files that the rig in a recording names; its code runs.",
            rich_help_panel=_OBSERVER,
        ),
    ] = False,
) -> None:
    """Run an observer over a recording and judge its velocity by a zero-phase reference.

    Uneven sampling and lost samples are allowed: each step has its measured length. Columns are found by name
    (time, position, torque ...), units by the end of a name (position_deg); options replace missing names.
    For a run of dcmp-hil, its observer and controller run again, with other gains if you give some.
    """
    from dcmp_hil.cli import execute_replay
    from dcmp_hil.cli.replay_options import ReplayOptions

    options = ReplayOptions(
        columns={
            "time": time,
            "position": position,
            "torque": torque,
            "voltage": voltage,
            "velocity": velocity,
            "time_unit": time_unit,
            "position_unit": position_unit,
            "torque_unit": torque_unit,
            "voltage_unit": voltage_unit,
            "velocity_unit": velocity_unit,
        },
        file={"period": period, "no_input": no_input or None, "modulus": modulus, "input_at": input_at},
        gains={"observer": observer, "f0": f0, "ku": ku, "mu0": mu0, "M": M, "L1": L1, "L2": L2},
        encoder={"rig": rig, "inertia": inertia, "counts_per_rev": counts_per_rev},
        figures={"start": window_from, "cutoff": cutoff},
        overrides=tuple(overrides or ()),
        variants=tuple(variants or ()),
    )
    outputs = execute_replay.Outputs(
        json=json_file, csv=csv, rrd=rrd, by_default=not no_write, force=force, rig=rig
    )
    if file.suffix == ".mcap" or file.is_dir():
        from dcmp_hil.cli.recorded_run import replay_own

        replay_own(file, options, outputs, trust=trust)
    else:
        columns, settings = options.column_options(), options.settings()
        execute_replay.execute(file, columns, settings, outputs, options.compared_settings())
