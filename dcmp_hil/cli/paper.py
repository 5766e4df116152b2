"""`dcmp-hil paper`: the paper, reproduced and judged."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dcmp_hil.cli import console
from dcmp_hil.cli.options import Force, JsonFile
from dcmp_hil.errors import ConfigError, ExitCode


def paper(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of figures 1 to 4.")] = Path("paper"),
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Print only the table.")] = False,
    json_file: JsonFile = None,
    force: Force = False,
) -> None:
    """Reproduce the paper: figures 1 to 4, and the effect of its printed equations.

    The exit code is 1 if a corrected figure is out of tolerance.
    """
    from dcmp_hil.cli.outputs import json_place, try_folder, try_places, write_each
    from dcmp_hil.cli.paper_view import misprint_table, reproduction_table
    from dcmp_hil.paper import FIGURES, as_json, draw, reproduce

    places = {"--json": json_place(json_file)}
    if not no_figures:
        try_folder("--out", out)
        places |= {f"--out {name}": out / name for name in FIGURES if (out / name).exists()}
    try_places(places, force=force)
    with console.err.status("running the paper's simulation, as meant and as printed ..."):
        reproduction = reproduce()
    drawn: list[Path] = []
    jobs = [
        (json_place(json_file), lambda path: console.write_json(str(path), as_json(reproduction.rows))),
        (None if no_figures else out, lambda folder: drawn.extend(draw(reproduction, folder))),
    ]
    _, faults = write_each(jobs)
    if json_file == "-":
        console.write_json("-", as_json(reproduction.rows))
    else:
        console.out.print(reproduction_table(reproduction))
        console.out.print(misprint_table(reproduction))
    for path in drawn:
        console.note(f"wrote {path}")
    passed = all(row.passed for row in reproduction.rows)
    if faults and passed:
        raise ConfigError(*faults)
    for sentence in faults:
        console.warn(sentence)
    if not passed:
        raise typer.Exit(ExitCode.FAILED)
