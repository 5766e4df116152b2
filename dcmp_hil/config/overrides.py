"""Overrides: `loop.rate_hz=500` on top of what a rig file says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.text import parse_value
from dcmp_hil.config.words import dotted, printable
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence

_LONGEST = 60  # characters of an override that are shown


def apply_overrides(table: dict[str, Any], overrides: Sequence[str]) -> set[str]:
    """Put overrides into a table that was read.

    Parameters
    ----------
    table
        The rig as it was read; changed in place.
    overrides
        `key=value` in dotted form; the last one of a key wins.

    Returns
    -------
    set of str
        Dotted keys that come from overrides, and tables that were not there before.

    Raises
    ------
    ConfigError
        With every override that is no `key=value`, or reaches into a value.
    """
    faults: list[str] = []
    pairs: dict[tuple[str, ...], Any] = {}
    for override in overrides:
        key, equals, text = override.partition("=")
        parts = tuple(part.strip() for part in key.split("."))
        if equals and all(parts):
            pairs.pop(parts, None)
            pairs[parts] = parse_value(text)
        else:
            faults.append(
                f"--set {printable(override)[:_LONGEST]}: expected KEY=VALUE, such as loop.rate_hz=500 "
                'or reference.kind="hold".'
            )
    for (name, *rest), kind in pairs.items():
        if rest == ["kind"]:
            _drop_keys_of_old_kind(table, name, kind)
    made: set[str] = set()
    for parts, value in pairs.items():
        faults += _put(table, parts, value, made)
    if faults:
        raise ConfigError(*faults)
    return made


def _put(table: dict[str, Any], parts: tuple[str, ...], value: Any, made: set[str]) -> list[str]:
    inner: Any = table
    for depth, part in enumerate(parts[:-1], start=1):
        if part not in inner:
            inner[part] = {}
            made.add(".".join(parts[:depth]))
        inner = inner[part]
        if not isinstance(inner, dict):
            key = dotted(parts[:depth])
            return [f"--set {dotted(parts)}: {key} is a value, not a table. Write --set {key}=VALUE."]
    inner[parts[-1]] = value
    made.add(".".join(parts))
    return []


def _drop_keys_of_old_kind(table: dict[str, Any], name: str, kind: Any) -> None:
    """Forget what only the old kind knew; what it did not know either stays, to be refused."""
    section, kinds = table.get(name), KINDS.get(name)
    if kinds is None or not isinstance(section, dict) or section.get("kind") == kind:
        return
    old = _settings(kinds, section.get("kind", next(iter(kinds))))
    new = _settings(kinds, kind)
    table[name] = {key: value for key, value in section.items() if key in new or key not in old}


def _settings(kinds: dict[str, Any], kind: Any) -> set[str]:
    if isinstance(kind, str) and kind in kinds:
        return set(kinds[kind].model_fields)
    return set(kinds["custom"].model_fields) if ":" in str(kind) and "custom" in kinds else set()
