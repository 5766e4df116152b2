"""Arguments that more than one command takes."""

from __future__ import annotations

from typing import Annotated

import typer

RigName = Annotated[
    str, typer.Argument(metavar="RIG", help="A shipped rig (see `dcmp-hil rigs`) or a rig.toml of your own.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Override a key, such as loop.rate_hz=500. Repeatable."),
]
Force = Annotated[bool, typer.Option("--force", help="Overwrite existing files, but never an input file.")]
JsonFile = Annotated[
    str | None,
    typer.Option("--json", metavar="FILE", help="Write the figures as JSON; - for standard output."),
]
