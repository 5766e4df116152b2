"""`dcmp-hil paper`: the paper, reproduced and judged."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dcmp_hil.cli import console
from dcmp_hil.cli.options import JsonFile


def paper(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where figures 1 to 4 go.")] = Path("paper"),
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Only the table.")] = False,
    json_file: JsonFile = None,
) -> None:
    """Reproduce the paper: figures 1 to 4, and what its printed equations cost.

    Exit code 1 if a corrected figure leaves its tolerance.
    """
    from dcmp_hil.cli.paper_view import misprint_table, reproduction_table
    from dcmp_hil.paper import as_json, draw, reproduce

    if not no_figures:
        console.make_folder(out)  # a place that cannot be written shows now, not after the runs
    with console.err.status("running the paper's simulation, as meant and as printed ..."):
        reproduction = reproduce()
    if json_file is not None:
        console.write_json(json_file, as_json(reproduction.rows))
    if json_file != "-":
        console.out.print(reproduction_table(reproduction))
        console.out.print(misprint_table(reproduction))
    if not no_figures:
        for path in draw(reproduction, out):
            console.note(f"wrote {path}")
    if not all(row.passed for row in reproduction.rows):
        raise typer.Exit(1)
