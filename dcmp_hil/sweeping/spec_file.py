"""Reading a sweep's file: every fault at once, each with its remedy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from dcmp_hil.common.similar_names import did_you_mean
from dcmp_hil.config.formatting import describe, dotted, printable, toml_value
from dcmp_hil.config.toml_text import parse
from dcmp_hil.errors import ConfigError
from dcmp_hil.sweeping.spec import DrawRule, GridRange, SweepSpec

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_FILE_BYTES_MAX = 1 << 20
_KEY_TABLES: Mapping[str, type[BaseModel] | None] = {"set": None, "grid": GridRange, "draw": DrawRule}
"""Tables whose keys are dotted keys of a rig, and the table that a value in them may be."""
_SHAPES = {
    "set": "a value",
    "grid": "a list of values, or { from = ..., to = ..., steps = ... }",
    "draw": "one of { uniform = [low, high] }, { loguniform = [low, high] }, { normal = [mean, deviation] } "
    "and { choice = [...] }",
}


def load_spec(source: str | Path) -> SweepSpec:
    """Read and check a sweep's file; what its keys mean for the rig is not looked at yet.

    Raises
    ------
    ConfigError
        With every fault found.
    """
    path, place = Path(source), printable(str(source))
    try:
        with path.open("rb") as file:
            raw = file.read(_FILE_BYTES_MAX + 1)
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigError(f"{place}: not UTF-8 text. Save the file as UTF-8.") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"{place}: {reason}. Check the path; docs/sweep.md shows a sweep's file.") from None
    if len(raw) > _FILE_BYTES_MAX:
        raise ConfigError(f"{place}: more than {_FILE_BYTES_MAX >> 20} MiB, which no sweep has. Check it.")
    spec = spec_from(parse(text, place), place)
    if spec.rig.endswith(".toml") or "/" in spec.rig:
        spec = spec.model_copy(update={"rig": str(path.parent / spec.rig)})
    return spec


def spec_from(table: Mapping[str, Any], place: str) -> SweepSpec:
    """Check the tables of a sweep that are there already; `place` is the first word of messages.

    Raises
    ------
    ConfigError
        With every fault found.
    """
    flat = dict(table)
    for name, inner in _KEY_TABLES.items():
        if isinstance(flat.get(name), dict):
            flat[name] = dict(_leaves(flat[name], _words(inner)))
    try:
        spec = SweepSpec.model_validate(flat)
    except ValidationError as error:
        raise ConfigError(*_sentences(error, flat, place)) from None
    both = sorted({*spec.grid} & {*spec.draw})
    if both:
        raise ConfigError(*(f"{place}, grid.{key}: it is in [draw], too. Remove one." for key in both))
    return spec


def _leaves(
    table: Mapping[str, Any], words: set[str], path: tuple[str, ...] = ()
) -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values: `model.f0_1_s = ...` in TOML is a table in a table.

    A table with one of `words` as a key, or with one that resembles them and no table inside, is a value.
    """
    for key, value in table.items():
        at = (*path, key)
        if isinstance(value, dict) and not words & {*value} and not _misspelt(value, words):
            yield from _leaves(value, words, at)
        else:
            yield ".".join(at), value


def _misspelt(value: Mapping[str, Any], words: set[str]) -> bool:
    inside = any(isinstance(one, dict) for one in value.values())
    return not inside and all(did_you_mean(key, words) for key in value)


def _words(model: type[BaseModel] | None) -> set[str]:
    return {field.alias or name for name, field in model.model_fields.items()} if model else set()


def _sentences(error: ValidationError, flat: Mapping[str, Any], place: str) -> list[str]:
    """Return a sentence for each key with a fault: the most telling one of those that pydantic has."""
    found: dict[tuple[str, ...], tuple[int, str]] = {}
    for one in error.errors(include_url=False):
        table, *rest = (str(part) for part in one["loc"])
        if table in _KEY_TABLES and rest:
            key = (table, *rest[0].split("."))
            told = _about_values(one, table, flat[table][rest[0]])
        else:
            key, told = (table,), (0, _about_key(one, table))
        found[key] = min(told, found.get(key, told))
    return [f"{place}, {dotted(key)}: {sentence}" for key, (_, sentence) in found.items()]


def _about_values(found: Mapping[str, Any], table: str, value: Any) -> tuple[int, str]:
    """Return how telling a fault of a grid or a draw is, 0 the most, and what to do about it."""
    kind, shape, last = str(found["type"]), _SHAPES[table], str(found["loc"][-1])
    inside = sorted(_words(_KEY_TABLES[table]) & {str(part) for part in found["loc"]})
    told = (5, f"got {toml_value(value)}; expected {shape}.")
    if kind == "extra_forbidden":
        known = sorted(_words(_KEY_TABLES[table]))
        hint = did_you_mean(last, known, f"Known here: {', '.join(known)}.", shown=str)
        told = (0, f"unknown key {toml_value(last)}. {hint}")
    elif kind == "value_error":
        told = (1, str(found["ctx"]["error"]))
    elif value == []:
        told = (2, "an empty range: got []. Write at least one value.")
    elif kind == "greater_than_equal" and last == "steps":
        told = (2, f"an empty range: got steps = {found['input']}. Write at least 1.")
    elif kind == "missing" and isinstance(value, dict):
        told = (3, f"{last} is missing; expected {shape}.")
    elif isinstance(value, dict) and inside:
        told = (4, f"got {toml_value(found['input'])} for {inside[0]}; expected {shape}.")
    return told


def _about_key(found: Mapping[str, Any], name: str) -> str:
    schema = SweepSpec.model_json_schema()["properties"]
    if found["type"] == "extra_forbidden":
        known = f"Known here: {', '.join(schema)}."
        return f"unknown key. {did_you_mean(name, schema, known, shown=str)}"
    if name in _KEY_TABLES:
        return f"got {toml_value(found['input'])}; expected a table of keys of the rig."
    expected, meaning = describe(schema[name]), str(schema[name].get("description", "")).replace("\n", " ")
    got = "missing" if found["type"] == "missing" else f"got {toml_value(found['input'])}"
    return f"{got}; expected {expected}. {meaning}"
