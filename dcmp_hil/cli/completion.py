"""`dcmp-hil completion`: a script with which a shell completes commands, options, keys and their values."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from dcmp_hil.cli import console


class Shell(StrEnum):
    """Shells that there is a script for."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def completion(
    context: typer.Context,
    shell: Annotated[Shell, typer.Argument(metavar="SHELL", help="Your shell: bash, zsh or fish.")],
) -> None:
    """Print a script with which a shell completes commands, options, keys of `--set` and their values.

    Keep it where your shell looks for such scripts, or load it in each shell by `source`. Completing starts
    no program and opens no device. Make the script again after an update.
    """
    from dcmp_hil.cli.shell_completion.scripts import SCRIPTS
    from dcmp_hil.cli.shell_completion.table import commands

    group = context.find_root().command
    console.out.file.write(SCRIPTS[shell](commands(group.commands)))  # type: ignore[attr-defined]
    console.out.file.flush()
