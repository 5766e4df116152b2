"""`dcmp-hil sweep`: many runs of a rig, over grids and draws of its keys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dcmp_hil.cli.options import JsonFile


def sweep(
    spec: Annotated[Path, typer.Argument(metavar="SPEC.toml", help="What is swept; see docs/sweep.md.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the results; by default sweeps/ and the name of SPEC."),
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Print runs, engine, CPU time and bytes; run only what is timed."),
    ] = False,
    plain: Annotated[
        bool, typer.Option("--plain", help="Run every run by the plain loop, as `run --fast` does.")
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=1024, help="Processes; by default one for each core."),
    ] = None,
    scheduler: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="Run on the Dask cluster whose scheduler is there: tcp://10.0.0.5:8786."
        ),
    ] = "",
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Draw no sweep.png.")] = False,
    json_file: JsonFile = None,
) -> None:
    """Run a rig many times in virtual time: a grid of its keys, draws of them, or both.

    Interrupted or killed, the same command continues with what is missing.
    """
    from dcmp_hil.cli.execute_sweep import SweepOptions, execute

    options = SweepOptions(
        out=out or Path("sweeps", spec.stem),
        dry_run=dry_run,
        plain=plain,
        workers=workers,
        scheduler=scheduler,
        picture=not no_picture,
        json_file=json_file,
    )
    raise typer.Exit(execute(spec, options))
