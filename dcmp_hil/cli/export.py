"""`dcmp-hil export`: a recording in other formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dcmp_hil.cli.options import Force


def export(
    file: Annotated[Path, typer.Argument(metavar="RUN", help="A run's folder, or its run.mcap.")],
    csv: Annotated[Path | None, typer.Option(metavar="FILE", help="Every signal, one row per cycle.")] = None,
    parquet: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The same as Parquet, for pandas and others.")
    ] = None,
    rrd: Annotated[Path | None, typer.Option(metavar="FILE", help="The dashboard, for Rerun.")] = None,
    force: Force = False,
) -> None:
    """Write a run's recording as CSV, Parquet, or a Rerun recording, without importing classes it names."""
    from dcmp_hil.cli.recorded_run import write_exports

    write_exports(file, csv=csv, parquet=parquet, rrd=rrd, force=force)
