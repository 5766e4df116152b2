"""The commands and their options, read from the command line itself: nothing can be added beside it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, get_args

from typer.main import get_command

from dcmp_hil.cli import app

if TYPE_CHECKING:
    import typer


@dataclass(frozen=True)
class Option:
    """Name, type and values of one option or argument.

    Parameters
    ----------
    name
        The flag, as ``--viewer``; an argument's name in capitals, as ``RIG``.
    is_flag
        Whether it stands alone.
    choices
        Its values where they are a list.
    """

    name: str
    is_flag: bool
    choices: tuple[str, ...]


def surface() -> dict[str, tuple[Option, ...]]:
    """Return every command with its options."""
    group = get_command(app)
    commands: dict[str, typer.core.TyperCommand] = group.commands  # type: ignore[attr-defined]
    return {name: tuple(map(_option, command.params)) for name, command in commands.items()}


def _option(parameter: object) -> Option:
    first: str = parameter.opts[0]  # type: ignore[attr-defined]
    return Option(
        name=first if first.startswith("-") else first.upper(),
        is_flag=bool(getattr(parameter, "is_flag", False)),
        choices=_choices(parameter.type_descriptor.annotation),  # type: ignore[attr-defined]
    )


def _choices(annotation: object) -> tuple[str, ...]:
    for one in (annotation, *get_args(annotation)):
        if isinstance(one, type) and issubclass(one, Enum):
            return tuple(str(member.value) for member in one)
    return ()
