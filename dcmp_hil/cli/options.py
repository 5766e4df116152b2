"""Arguments that more than one command takes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from dcmp_hil.common.durations import seconds
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable

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


def duration_of(option: str) -> Callable[[str | float], float]:
    """Return what reads the value of an option: a duration such as `10s`, `200ms` or `2min`, in s."""

    def read(value: str | float) -> float:
        try:
            return seconds(value) if isinstance(value, str) else value  # a default is a number
        except ValueError as error:
            raise ConfigError(f"{option}: {error}") from None

    return read


def length_of(option: str) -> Callable[[str | float], float]:
    """Return what reads the value of an option: a duration that is 0 or more, in s; 0 is until Ctrl-C."""
    duration = duration_of(option)

    def read(value: str | float) -> float:
        length = duration(value)
        if length < 0.0:
            raise ConfigError(
                f'{option}: got "{value}"; expected 0 (until Ctrl-C) or more, such as 10s or 2min.'
            )
        return length

    return read
