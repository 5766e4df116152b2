"""`dcmp-hil replay`: an observer over a recording, judged by a zero-phase reference."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from dcmp_hil.cli.options import JsonFile, Overrides
from dcmp_hil.errors import ConfigError

_COLUMNS = "Columns and units (found by name where not given)"
_OBSERVER = "Observer and rig"
_FIGURES = "Figures"
_OUTPUT = "Output"


class InputAt(StrEnum):
    """Which row holds the input over [k-1, k)."""

    START = "start"
    END = "end"


def _column(quantity: str, *more: str) -> Any:
    flags = (f"--{quantity}", f"--{quantity}-column", *more)
    return typer.Option(*flags, metavar="COLUMN", help=f"Column of the {quantity}.", rich_help_panel=_COLUMNS)


def _unit(quantity: str, units: str) -> Any:
    return typer.Option(
        f"--{quantity}-unit", metavar="UNIT", help=f"Its unit: {units}.", rich_help_panel=_COLUMNS
    )


def _number(*flags: str, unit: str, text: str, panel: str = _OBSERVER) -> Any:
    return typer.Option(*flags, metavar=unit, help=text, rich_help_panel=panel)


def replay(  # noqa: PLR0913 - typer reads the options from the signature
    file: Annotated[
        Path, typer.Argument(metavar="FILE.csv", help="Recording with time, position, torque or voltage.")
    ],
    *,
    overrides: Overrides = None,
    time: Annotated[str | None, _column("time")] = None,
    position: Annotated[str | None, _column("position")] = None,
    torque: Annotated[str | None, _column("torque")] = None,
    voltage: Annotated[str | None, _column("voltage")] = None,
    velocity: Annotated[str | None, _column("velocity")] = None,
    time_unit: Annotated[str | None, _unit("time", "s, ms, us, ns")] = None,
    position_unit: Annotated[str | None, _unit("position", "rad, mrad, deg, rev, counts")] = None,
    torque_unit: Annotated[str | None, _unit("torque", "Nm, mNm, Ncm")] = None,
    voltage_unit: Annotated[str | None, _unit("voltage", "V, mV")] = None,
    velocity_unit: Annotated[str | None, _unit("velocity", "rad/s, deg/s, rev/s, rpm")] = None,
    input_at: Annotated[
        InputAt,
        typer.Option(
            help="Row that holds the input over [k-1, k): start = row k-1, end = row k.",
            rich_help_panel=_COLUMNS,
        ),
    ] = InputAt.START,
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
    period: Annotated[
        float | None,
        _number("--period", unit="S", text="Nominal sampling period T. Default: the median step."),
    ] = None,
    observer: Annotated[
        str, _number("--observer", unit="NAME", text="super_twisting, paper, or module:Class of your own.")
    ] = "super_twisting",
    f0: Annotated[float, _number("--f0", unit="1/S", text="Viscous friction over inertia.")] = 0.1,
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
    L1: Annotated[float, _number("--L1", unit="1/S", text="Copy gain.")] = 4.9,
    L2: Annotated[float, _number("--L2", unit="1/S2", text="Copy gain.")] = 5.51,
    window_from: Annotated[
        float,
        _number(
            "--from",
            unit="S",
            panel=_FIGURES,
            text="Judge what is later than this, and so after every restart.",
        ),
    ] = 0.3,
    cutoff: Annotated[
        float, _number("--cutoff", unit="HZ", panel=_FIGURES, text="Corner of the zero-phase reference.")
    ] = 15.0,
    json_file: JsonFile = None,
    csv: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Default: <FILE>-replay.csv here.", rich_help_panel=_OUTPUT),
    ] = None,
    rrd: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Default: <FILE>-replay.rrd here.", rich_help_panel=_OUTPUT),
    ] = None,
    no_write: Annotated[
        bool, typer.Option("--no-write", help="Write only the files named.", rich_help_panel=_OUTPUT)
    ] = False,
) -> None:
    """Run an observer over a recording and judge its velocity by a zero-phase reference.

    Uneven sampling and lost samples are fine: every step takes the measured time. Columns are found by name
    (time, position, torque ...), units by the name's end (position_deg); options say what names do not.
    """
    from dcmp_hil.cli.replaying import Outputs, execute
    from dcmp_hil.replay import ColumnOptions, ReplaySettings

    if file.suffix == ".mcap" or file.is_dir():
        from dcmp_hil.cli.own_recording import replay_own

        replay_own(file, overrides or (), json_file)
        return
    if overrides:
        raise ConfigError(
            "--set is for recordings of dcmp-hil itself (run.mcap); here say --mu0, --f0 and so on."
        )
    counts = _counts(counts_per_rev)
    settings = ReplaySettings(
        observer=observer if ":" in observer else observer.lower().replace("-", "_"),
        f0=f0,
        inertia=inertia,
        ku=ku,
        input_at=input_at.value,
        counts_per_rev=counts,
        period=period,
        L1=L1,
        L2=L2,
        M=M,
        mu0=mu0,
        start=window_from,
        cutoff=cutoff,
    )
    columns = ColumnOptions(
        time=time,
        position=position,
        torque=torque,
        voltage=voltage,
        velocity=velocity,
        time_unit=time_unit,
        position_unit=position_unit,
        torque_unit=torque_unit,
        voltage_unit=voltage_unit,
        velocity_unit=velocity_unit,
        prefer="torque" if inertia is not None else "voltage" if ku is not None else None,
        counts_per_rev=None if counts == "ideal" else counts,
    )
    execute(file, columns, settings, Outputs(json=json_file, csv=csv, rrd=rrd, by_default=not no_write))


def _counts(text: str | None) -> float | Literal["ideal"] | None:
    if text is None:
        return None
    if text.lower() == "ideal":
        return "ideal"
    try:
        return float(text)
    except ValueError:
        raise ConfigError(
            f'--counts-per-rev: got "{text}". Write the counts after quadrature, such as 4096, or ideal.'
        ) from None
