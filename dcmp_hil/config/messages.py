"""Faults of a rig in the reader's words: place, what was got, what was expected, remedy."""

from __future__ import annotations

import json
import math
import re
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from dcmp_hil.config.rig import KINDS, Rig
from dcmp_hil.config.units import factor, split_unit

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from pydantic import BaseModel, ValidationError

_LONGEST = 60  # characters of a value that are shown


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
        Dotted keys that came from overrides, and are called `--set`.
    """
    faults: dict[str, str] = {}
    for found in error.errors(include_url=False):
        if found["loc"] == ():
            for line in str(found["ctx"]["error"] if "ctx" in found else found["msg"]).splitlines():
                faults.setdefault(line, f"{place}: {line}")
            continue
        path = _key_path(found["loc"], table)
        if found["type"].startswith("union_tag") and isinstance(found["input"], dict):
            path = (*path, "kind")
        key = ".".join(path)
        where = "--set" if key in set_keys else f"{place},"
        faults.setdefault(key, f"{where} {key}: {_sentence(found['type'], path, found['input'], table)}")
    return list(faults.values())


def section_model(path: tuple[str, ...], table: Mapping[str, Any]) -> type[BaseModel]:
    """Return the model of the table that the key `path` is in."""
    model: type[BaseModel] = Rig
    for part in path[:-1]:
        if part in KINDS and model is Rig:
            section = table.get(part)
            kind = str(section.get("kind", "")) if isinstance(section, dict) else ""
            kinds = KINDS[part]
            model = kinds.get(kind) or (
                kinds["custom"] if ":" in kind and "custom" in kinds else next(iter(kinds.values()))
            )
            continue
        inner: Any = model.model_fields[part].annotation if part in model.model_fields else None
        if not hasattr(inner, "model_fields"):
            break
        model = inner
    return model


def describe(schema: Mapping[str, Any]) -> str:
    """Say in words what a JSON schema of one value allows."""
    if "anyOf" in schema:
        return " or ".join(describe(one) for one in schema["anyOf"] if one.get("type") != "null")
    if "const" in schema:
        return toml_value(schema["const"])
    if "enum" in schema:
        return " or ".join(toml_value(value) for value in schema["enum"])
    kind = {
        "number": "a number",
        "integer": "a whole number",
        "boolean": "true or false",
        "string": "text",
    }.get(str(schema.get("type")), "a table")
    return f"{kind}{_bounds(schema)}"


def toml_value(value: Any) -> str:
    """Write a value as TOML would, shortened."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, str):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, dict):
        text = "a table"
    elif isinstance(value, list):
        text = "a list"
    elif isinstance(value, float):
        text = f"{value:g}"
    else:
        text = str(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def _key_path(loc: tuple[int | str, ...], table: Mapping[str, Any]) -> tuple[str, ...]:
    """Strip what pydantic adds to a place: tags of unions and names of types."""
    parts = [str(part) for part in loc]
    if len(parts) > 1 and parts[0] in KINDS and parts[1] in KINDS[parts[0]]:
        del parts[1]
    path: list[str] = []
    value: Any = table
    for part in parts:
        if path and not isinstance(value, dict):
            break
        path.append(part)
        value = value.get(part) if isinstance(value, dict) else None
    return tuple(path)


def _sentence(kind: str, path: tuple[str, ...], value: Any, table: Mapping[str, Any]) -> str:
    if kind == "extra_forbidden":
        return _unknown_key(path, value, table)
    if kind.startswith("union_tag"):
        return _unknown_kind(path[0], value)
    model = section_model(path, table)
    schema = model.model_json_schema()["properties"].get(path[-1], {})
    meaning = str(schema.get("description", "")).replace("\n", " ")
    expected = describe(schema) if schema else "a table"
    if kind == "missing":
        return f"missing; expected {expected}. {meaning}"
    hint = _text_hint(path[-1], value, expected)
    return f"got {toml_value(value)}; expected {expected}.{hint} {meaning}".rstrip()


def _text_hint(key: str, value: Any, expected: str) -> str:
    """Show how to write a number that came in quotes, perhaps with its unit."""
    if not isinstance(value, str) or "number" not in expected:
        return ""
    number = re.match(r"\s*[-+]?\d+(\.\d*)?([eE][-+]?\d+)?", value)
    return f" Write {key} = {number.group().strip()}, without quotes or unit." if number else ""


def _unknown_kind(section: str, value: Any) -> str:
    kinds = [name for name in KINDS[section] if name != "custom"]
    if not isinstance(value, dict):
        return f"got {toml_value(value)}; expected a table, as in [{section}]."
    got = value.get("kind")
    close = get_close_matches(str(got), kinds, n=1, cutoff=0.4)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    own = ', or "module:Class" of your own' if "custom" in KINDS[section] else ""
    return f"got {toml_value(got)}; expected one of {', '.join(kinds)}{own}.{hint}"


def _unknown_key(path: tuple[str, ...], value: Any, table: Mapping[str, Any]) -> str:
    known = list(section_model(path, table).model_fields)
    key = path[-1]
    return "unknown key. " + (
        _other_unit(key, value, known)
        or _other_spelling(key, known)
        or _other_table(key)
        or f"Known here: {', '.join(known)}."
    )


def _other_unit(key: str, value: Any, known: list[str]) -> str:
    """Recognise the right quantity in the wrong unit, and a period given instead of a rate."""
    stem, unit = split_unit(key)
    seconds = factor(unit, "s")
    number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    if stem == "period" and seconds is not None and "rate_hz" in known:
        return f"The rate is given instead: rate_hz{f' = {1 / (number * seconds):g}' if number > 0 else ''}."
    for other in known:
        other_stem, wanted = split_unit(other)
        if other_stem == stem and wanted and wanted != unit:
            scale = factor(unit, wanted)
            shown = f" = {number * scale:g}" if scale is not None and math.isfinite(number) else ""
            return f"It is given in {wanted.replace('_', '/')}: {other}{shown}."
    return ""


def _other_spelling(key: str, known: list[str]) -> str:
    """Compare whole keys, then keys without their units."""
    close = get_close_matches(key, known, n=1, cutoff=0.6)
    if not close:
        stems = {split_unit(other)[0]: other for other in known}
        close = [stems[stem] for stem in get_close_matches(split_unit(key)[0], list(stems), n=1, cutoff=0.6)]
    return f"Did you mean {close[0]}?" if close else ""


def _other_table(key: str) -> str:
    """Look for the key in every other table."""
    models: dict[str, type[BaseModel]] = {}
    for name, field in Rig.model_fields.items():
        if (
            name not in KINDS
            and isinstance(field.annotation, type)
            and hasattr(field.annotation, "model_fields")
        ):
            models[name] = field.annotation
    for name, kinds in KINDS.items():
        models[name] = next((model for model in kinds.values() if key in model.model_fields), Rig)
    homes = [name for name, model in models.items() if model is not Rig and key in model.model_fields]
    return f"It belongs in [{homes[0]}]." if homes else ""


def _bounds(schema: Mapping[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    above, below = schema.get("exclusiveMinimum"), schema.get("exclusiveMaximum")
    parts = []
    if low is not None:
        parts.append(f"at least {low:g}")
    if above is not None:
        parts.append(f"above {above:g}")
    if high is not None:
        parts.append(f"at most {high:g}")
    if below is not None:
        parts.append(f"below {below:g}")
    return f", {' and '.join(parts)}" if parts else ""
