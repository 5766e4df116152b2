"""`dcmp-hil check`: is this rig right, and what does it come to."""

from __future__ import annotations

from dcmp_hil.cli import console
from dcmp_hil.cli.options import Overrides, RigName


def check(rig: RigName, overrides: Overrides = None) -> None:
    """Check a rig without running it: every fault at once, or every key with its value."""
    from rich.table import Table

    from dcmp_hil.config import load_rig
    from dcmp_hil.config.explain import explain, warnings

    loaded = load_rig(rig, overrides or ())
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(style="bold")
    table.add_column(style="dim")
    for row in explain(loaded):
        table.add_row(*row)
    console.out.print(table)
    for sentence in warnings(loaded):
        console.warn(sentence)
    console.out.print(f"[green]{loaded.name}: no faults[/green]")
