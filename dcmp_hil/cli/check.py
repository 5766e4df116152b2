"""`dcmp-hil check`: is this rig right, and what does it come to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dcmp_hil.cli import console
from dcmp_hil.cli.options import Overrides, RigName
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence


def check(
    rig: RigName,
    overrides: Overrides = None,
    write: Annotated[
        bool,
        typer.Option(
            "--write",
            help="Write what --set says into the rig's file, and print the difference. Comments, order and "
            "every other line stay.",
        ),
    ] = False,
) -> None:
    """Check a rig without running it: print every fault at once, or every key with its value."""
    from rich.text import Text

    from dcmp_hil.config import load_rig
    from dcmp_hil.config.explain import explain, warnings
    from dcmp_hil.config.plugin_check import check_named

    loaded = load_rig(rig, overrides or ())
    check_named(loaded)
    if write:
        _write(rig, overrides or ())
        return
    terminal = console.out.is_terminal
    for key, value, meaning in explain(loaded):
        line = Text.assemble(f"{key:36}", (f"{value:18}", "bold"), (f" {meaning}", "dim"))
        console.out.print(line, no_wrap=True, crop=terminal, overflow="ellipsis" if terminal else "ignore")
    for sentence in warnings(loaded):
        console.warn(sentence)
    console.out.print(Text(f"{loaded.name}: no faults", style="green"))


def _write(rig: str, overrides: Sequence[str]) -> None:
    """Write overrides, which the rig takes, into its file.

    Raises
    ------
    ConfigError
        If there are none, the rig has no file, or it cannot be edited.
    """
    from rich.text import Text

    from dcmp_hil.config.edited_file import is_file, propose

    if not overrides:
        raise ConfigError("--write: nothing to write. Say --set KEY=VALUE, and it is written into the file.")
    if not is_file(rig):
        raise ConfigError(
            f"--write: {rig} is a shipped rig, and has no file of yours. Copy it first: dcmp-hil rigs --copy "
            f"{rig} my.toml"
        )
    proposal = propose(Path(rig), overrides)
    if not proposal.diff:
        console.note(f"{rig} says so already")
        return
    proposal.write()
    console.out.print(Text(proposal.diff), no_wrap=True, overflow="ignore", crop=False)
    console.note(f"wrote {rig}")
