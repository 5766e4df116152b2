"""Tunable keys of a rig as overrides: those that lead from one rig to another, and all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.common.number_range import number
from dcmp_hil.config.formatting import toml_value
from dcmp_hil.config.sections import Custom
from dcmp_hil.live.tunables import settable, value_of

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

_TABLES = ("controller", "observer", "reference")


def overrides_between(before: Rig, after: Rig) -> list[str]:
    """Return the overrides that give one rig the tunable values of another.

    Where a table has another kind, all of its keys are named. A reference that no run changes to (`csv`) is
    left out.
    """
    return [
        f"{key}={text}"
        for table in _TABLES
        for key, text in _texts(after, table).items()
        if _kind(before, table) != _kind(after, table) or _texts(before, table).get(key) != text
    ]


def tunable_overrides(rig: Rig) -> list[str]:
    """Return every tunable key of a rig with its value, and the kinds of their tables, as overrides."""
    return [f"{key}={text}" for table in _TABLES for key, text in _texts(rig, table).items()]


def _texts(rig: Rig, table: str) -> dict[str, str]:
    section = getattr(rig, table)
    if isinstance(section, Custom) or not getattr(section, "in_run", True):
        return {}
    keys = [key for key in settable(rig) if key.startswith(f"{table}.")]
    texts = {key: _text(value_of(rig, key)) for key in keys}
    return {f"{table}.kind": toml_value(section.kind), **texts}


def _kind(rig: Rig, table: str) -> str:
    return str(getattr(rig, table).kind)


def _text(value: Any) -> str:
    return number(value) if isinstance(value, float) else toml_value(value)
