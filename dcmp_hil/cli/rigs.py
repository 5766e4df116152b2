"""`dcmp-hil rigs`: the rigs that come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from dcmp_hil.cli import console

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

_NAME_COLUMNS = 12


def rigs(
    copy: Annotated[
        tuple[str, Path] | None,
        typer.Option("--copy", metavar="NAME FILE", help="Write a commented rig.toml to start from."),
    ] = None,
) -> None:
    """List the shipped rigs, or copy one."""
    from dcmp_hil.config import copy_rig, load_rig, shipped_rigs

    if copy is not None:
        for path in copy_rig(*copy):
            console.out.print(f"wrote {path}", highlight=False, markup=False)
        return
    for name in shipped_rigs():
        rig = load_rig(name)
        facts = (
            f" {rig.loop.rate_hz:g} Hz, encoder {_counts(rig)}, observer {rig.observer.kind}, "
            f"backend {rig.backend.kind}"
        )
        line = Text.assemble((f"{name:{_NAME_COLUMNS}}", "bold"), facts)
        console.print_sentence(console.out, line, indent=_NAME_COLUMNS + 1)


def _counts(rig: Rig) -> str:
    return "ideal" if rig.encoder.counts is None else f"{rig.encoder.counts:g} counts"
