"""`dcmp-hil check`: is this rig right, and what does it come to."""

from __future__ import annotations

from dcmp_hil.cli import console
from dcmp_hil.cli.options import Overrides, RigName


def check(rig: RigName, overrides: Overrides = None) -> None:
    """Check a rig without running it: print every fault at once, or every key with its value."""
    from rich.text import Text

    from dcmp_hil.config import load_rig
    from dcmp_hil.config.explain import explain, warnings
    from dcmp_hil.config.plugin_check import check_named

    loaded = load_rig(rig, overrides or ())
    check_named(loaded)
    terminal = console.out.is_terminal
    for key, value, meaning in explain(loaded):
        line = Text.assemble(f"{key:36}", (f"{value:18}", "bold"), (f" {meaning}", "dim"))
        console.out.print(line, no_wrap=True, crop=terminal, overflow="ellipsis" if terminal else "ignore")
    for sentence in warnings(loaded):
        console.warn(sentence)
    console.out.print(Text(f"{loaded.name}: no faults", style="green"))
