"""Roles of a user's class in rig.toml, and its required methods."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping


class Role(NamedTuple):
    """A role that a class of the user's own may have.

    Parameters
    ----------
    key
        Of rig.toml, or an option, that names it.
    call
        How it is made, in words.
    arguments
        With how many of them, the options left out.
    methods
        What it must have, and with how many arguments each is called.
    """

    key: str
    call: str
    arguments: int
    methods: Mapping[str, int]


OBSERVER = Role(
    "observer.kind", "Class(context, **options) with the keys of [observer.options]", 1, {"update": 1}
)
CONTROLLER = Role(
    "controller.kind", "Class(context, **options) with the keys of [controller.options]", 1, {"update": 2}
)
BACKEND = Role(
    "backend.kind",
    "Factory(rig, clock)",
    2,
    {"__enter__": 0, "__exit__": 3, "read": 0, "write": 1, "truth": 0},
)
