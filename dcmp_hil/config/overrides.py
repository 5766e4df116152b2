"""Overrides: `loop.rate_hz=500` on top of what a rig file says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.config.formatting import dotted, printable
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.toml_text import parse_value
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_SHOWN_CHARS_MAX = 60  # characters of an override that are shown
_OVERRIDES_MAX = 200
_OVERRIDE_CHARS_MAX = 8192  # of one override; a path has 4096 at most
_KEY_PARTS_MAX = 8  # parts of a dotted key; a rig's longest has 2, a class of the user's own may have tables


def apply_overrides(table: dict[str, Any], overrides: Sequence[str]) -> set[str]:
    """Apply overrides, of the command line or of a change, to the table of a rig.

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
        With every override that is no `key=value`, is too long, or reaches into a value.
    """
    pairs, faults = _parsed(overrides)
    return apply_values(table, pairs, faults)


def apply_values(
    table: dict[str, Any], pairs: Mapping[tuple[str, ...], Any], faults: Sequence[str] = ()
) -> set[str]:
    """Apply values of keys, as parts, to the table of a rig; see `apply_overrides`.

    `faults` are raised with those that are found here.
    """
    found = list(faults)
    for (name, *rest), kind in pairs.items():
        if rest == ["kind"]:
            _drop_keys_of_old_kind(table, name, kind)
    made: set[str] = set()
    for parts, value in pairs.items():
        found += _put(table, parts, value, made)
    if found:
        raise ConfigError(*found)
    return made


def _parsed(overrides: Sequence[str]) -> tuple[dict[tuple[str, ...], Any], list[str]]:
    """Return keys with values, and a sentence for each override that is none; work and text are bounded."""
    if len(overrides) > _OVERRIDES_MAX:
        return {}, [f"--set: {len(overrides)} at once; at most {_OVERRIDES_MAX}. Write them into a rig file."]
    faults: list[str] = []
    pairs: dict[tuple[str, ...], Any] = {}
    for override in overrides:
        key, equals, text = override.partition("=")
        shown = printable(override[:_SHOWN_CHARS_MAX])[:_SHOWN_CHARS_MAX]
        parts = tuple(part.strip() for part in key.split(".", _KEY_PARTS_MAX))
        if len(override) > _OVERRIDE_CHARS_MAX or len(parts) > _KEY_PARTS_MAX:
            faults.append(
                f"--set {shown}...: too long; at most {_OVERRIDE_CHARS_MAX} characters, and {_KEY_PARTS_MAX} "
                "parts of a key. Write it into the rig file."
            )
        elif equals and all(parts):
            pairs.pop(parts, None)
            pairs[parts] = parse_value(text)
        else:
            faults.append(
                f'--set {shown}: expected KEY=VALUE, such as loop.rate_hz=500 or reference.kind="hold".'
            )
    return pairs, faults


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
