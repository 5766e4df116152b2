"""Faults of a rig in the reader's words: place, what was got, what was expected, remedy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from dcmp_hil.config import suggestions
from dcmp_hil.config.formatting import describe, dotted, toml_value
from dcmp_hil.config.rig import KINDS, Rig

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from pydantic import ValidationError


def explain_faults(
    error: ValidationError, table: Mapping[str, Any], place: str, set_keys: Collection[str]
) -> list[str]:
    """Turn everything pydantic found into sentences, one fault each.

    Parameters
    ----------
    error
        From checking `table`.
    table
        The rig as it was read, overrides included.
    place
        What to call the file.
    set_keys
        Dotted keys, and tables as a whole, that came from overrides; their faults are placed at `--set`.
    """
    faults: dict[tuple[str, ...], str] = {}
    for found in error.errors(include_url=False):
        if found["loc"] == ():
            for line in str(found["ctx"]["error"] if "ctx" in found else found["msg"]).splitlines():
                rule_path = tuple(line.partition(":")[0].split("."))
                faults.setdefault(rule_path, f"{_place(rule_path, place, set_keys)} {line}")
            continue
        path = _key_path(found["loc"], table)
        if found["type"].startswith("union_tag") and isinstance(found["input"], dict):
            path = (*path, "kind")
        asked_for = found["type"] == "missing" and f"{path[0]}.kind" in set_keys
        where = "--set" if asked_for else _place(path, place, set_keys)
        faults.setdefault(path, f"{where} {dotted(path)}: {_sentence(found, path, table)}")
    return list(faults.values())


def _place(path: tuple[str, ...], place: str, set_keys: Collection[str]) -> str:
    """Return where a key was written: in the file, or in an override of it or of a table around it."""
    around = (".".join(path[:depth]) for depth in range(1, len(path) + 1))
    return "--set" if any(key in set_keys for key in around) else f"{place},"


def _key_path(loc: tuple[int | str, ...], table: Mapping[str, Any]) -> tuple[str, ...]:
    """Strip what pydantic adds to a place: tags of unions and names of types."""
    parts = [str(part) for part in loc]
    if len(parts) > 1 and parts[0] in KINDS and parts[1] in KINDS[parts[0]]:
        del parts[1]
    path: list[str] = []
    model: type[BaseModel] | None = Rig
    for part in parts:
        if model is None:
            break
        path.append(part)
        model = _inner(model, part, table)
    return tuple(path)


def _inner(model: type[BaseModel], part: str, table: Mapping[str, Any]) -> type[BaseModel] | None:
    """Return the model of a table inside a table; None if `part` is no table."""
    if model is Rig and part in KINDS:
        section = table.get(part)
        kind = str(section.get("kind", "")) if isinstance(section, dict) else ""
        kinds = KINDS[part]
        default = kinds["custom"] if ":" in kind and "custom" in kinds else next(iter(kinds.values()))
        return kinds.get(kind, default)
    annotation = model.model_fields[part].annotation if part in model.model_fields else None
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return None


def _sentence(found: Mapping[str, Any], path: tuple[str, ...], table: Mapping[str, Any]) -> str:
    kind, value = str(found["type"]), found["input"]
    model: type[BaseModel] = Rig
    for part in path[:-1]:
        model = _inner(model, part, table) or model
    if kind == "extra_forbidden":
        return f"unknown key. {suggestions.for_unknown_key(path, value, model)}"
    if kind.startswith("union_tag") and isinstance(value, dict):
        got = value.get("kind")
        return f"got {toml_value(got)}; {suggestions.for_unknown_kind(path[0], got)}"
    inside = _inner(model, path[-1], table)
    if inside is not None:
        key = dotted((*path, next(iter(inside.model_fields))))
        return f"got {toml_value(value)}; expected a table with keys such as {key}."
    return _about_value(kind, path[-1], value, model.model_json_schema()["properties"].get(path[-1], {}))


def _about_value(kind: str, key: str, value: Any, schema: Mapping[str, Any]) -> str:
    meaning = str(schema.get("description", "")).replace("\n", " ")
    expected = describe(schema)
    if kind == "missing":
        return f"missing; expected {expected}. {meaning}"
    hint = suggestions.for_text(key, value, schema) if isinstance(value, str) else ""
    return f"got {toml_value(value)}; expected {expected}.{hint and ' '}{hint} {meaning}".rstrip()
