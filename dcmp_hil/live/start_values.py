"""Keys of a rig as overrides: those that lead from one rig to another, and those of a run for a rig file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.common.number_range import number
from dcmp_hil.config import change_rig
from dcmp_hil.config.formatting import toml_value
from dcmp_hil.config.sections import Custom
from dcmp_hil.live.tunables import settable, value_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from dcmp_hil.common.section import Section
    from dcmp_hil.config import Rig

_TABLES = ("controller", "observer", "reference")


def overrides_between(before: Rig, after: Rig) -> list[str]:
    """Return the overrides that give one rig the tunable values of another.

    Where a table has another kind, all of its keys are named, but for those that a rule works out. A
    reference that no run changes to (`csv`) is left out: see `kept_references`.
    """
    return [
        f"{key}={text}"
        for table in _TABLES
        for key, text in _texts(after, table).items()
        if _is_named(before, after, key, text)
    ]


def kept_references(before: Rig, after: Rig) -> list[str]:
    """Return the keys of a reference of one rig that no run changes to, where the other has another one."""
    reference = after.reference
    same = reference == before.reference
    return [] if same or _in_run(reference) else [f"reference.kind={toml_value(reference.kind)}"]


def tunable_overrides(rig: Rig) -> list[str]:
    """Return every tunable key of a rig that no rule works out, and the kinds of their tables."""
    return [
        f"{key}={text}"
        for table in _TABLES
        for key, text in _texts(rig, table).items()
        if not _left_to_rule(rig, key)
    ]


def table_overrides(rig: Rig) -> dict[str, list[str]]:
    """Return by table the tunable keys of a rig and all else that it states, for `overrides_for_file`."""
    return {table: _whole(rig, table) for table in _TABLES if _texts(rig, table)}


def overrides_for_file(there: Rig, values: Sequence[str], tables: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the overrides that put the values of a run into its rig file.

    A table that has another kind in the file is written as a whole: its other keys came with the kind.

    Parameters
    ----------
    there
        The rig of the file.
    values, tables
        The `tunable_overrides` and `table_overrides` of the run.

    Raises
    ------
    ConfigError
        If they break a rule of the file's rig.
    """
    other = [
        table
        for table, whole in tables.items()
        if f"{table}.kind={toml_value(_kind(there, table))}" not in whole
    ]
    whole = [override for table in other for override in tables[table]]
    after = change_rig(there, [*_outside(other, values), *whole])
    return _outside(other, overrides_between(there, after)) + whole


def _outside(tables: Sequence[str], overrides: Sequence[str]) -> list[str]:
    return [override for override in overrides if override.partition(".")[0] not in tables]


def _is_named(before: Rig, after: Rig, key: str, text: str) -> bool:
    table = key.partition(".")[0]
    old = _texts(before, table).get(key)
    if _left_to_rule(after, key):
        return old not in (None, text)
    return _kind(before, table) != _kind(after, table) or old != text


def _left_to_rule(rig: Rig, key: str) -> bool:
    table, _, name = key.partition(".")
    return getattr(getattr(rig, table), name) is None


def _in_run(section: Section) -> bool:
    """Return whether a run can change to it; a class of one's own it cannot."""
    return not isinstance(section, Custom) and bool(getattr(section, "in_run", True))


def _whole(rig: Rig, table: str) -> list[str]:
    section = getattr(rig, table)
    keys = dict.fromkeys(
        [*_texts(rig, table), *(f"{table}.{name}" for name in sorted(section.model_fields_set))]
    )
    return [
        f"{key}={_text(getattr(section, key.partition('.')[2]))}"
        for key in keys
        if not _left_to_rule(rig, key)
    ]


def _texts(rig: Rig, table: str) -> dict[str, str]:
    section = getattr(rig, table)
    if not _in_run(section):
        return {}
    keys = [key for key in settable(rig) if key.startswith(f"{table}.")]
    texts = {key: _text(value_of(rig, key)) for key in keys}
    return {f"{table}.kind": toml_value(section.kind), **texts}


def _kind(rig: Rig, table: str) -> str:
    return str(getattr(rig, table).kind)


def _text(value: Any) -> str:
    return number(value) if isinstance(value, float) else toml_value(value)
