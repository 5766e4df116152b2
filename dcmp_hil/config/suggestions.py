"""Remedies: what the author of a rig may have meant by an unknown key, or by a number in quotes."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from dcmp_hil.common.similar_names import did_you_mean
from dcmp_hil.config.formatting import toml_value
from dcmp_hil.config.rig import KINDS, Rig
from dcmp_hil.config.units import factor, in_words, split_unit, unit_named

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import BaseModel

_PERIOD_NAMES = ("period", "dt", "sample_time", "cycle_time")
_NUMBER_WITH_UNIT = re.compile(r"\s*([-+]?\d+(?:[.,]\d*)?(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.DOTALL)


def for_unknown_key(path: tuple[str, ...], value: Any, model: type[BaseModel]) -> str:
    """Return a remedy for the unknown key at `path`, in a table that is described by `model`."""
    key, known = path[-1], list(model.model_fields)
    return (
        _other_unit(key, value, known)
        or _other_home(path, key)
        or _other_spelling(key, known)
        or f"Known here: {', '.join(known)}."
    )


def for_unknown_kind(section: str, got: Any) -> str:
    """Return a remedy for an unknown kind: the known kinds, and the likely one."""
    kinds = [name for name in KINDS[section] if name != "custom"]
    hint = did_you_mean(str(got), kinds, cutoff=0.4)
    return f"expected {kinds_in_words(section)}.{hint and ' '}{hint}"


def kinds_in_words(section: str) -> str:
    """List the kinds of a table."""
    kinds = [toml_value(name) for name in KINDS[section] if name != "custom"]
    own = ', or "module:Class" of your own' if "custom" in KINDS[section] else ""
    return f"one of {', '.join(kinds)}{own}"


def for_text(key: str, text: str, schema: Mapping[str, Any]) -> str:
    """Return a remedy for a text that is not allowed."""
    branches = [schema, *schema.get("anyOf", [])]
    words = {
        str(word): word
        for one in branches
        for word in (*one.get("enum", ()), one.get("const"))
        if word is not None
    }
    is_number = any(one.get("type") == "number" for one in branches)
    otherwise = _quoted_number(key, text) if is_number else ""
    return did_you_mean(text, words, otherwise, shown=lambda word: toml_value(words[word]))


def _quoted_number(key: str, text: str) -> str:
    """Show how to write a number that came in quotes, perhaps with its unit, perhaps with another one."""
    unit = split_unit(key)[1]
    found = _NUMBER_WITH_UNIT.fullmatch(text)
    got = _number_in(found[1]) if found else None
    if found and got is not None and found[2]:
        scale = factor(unit_named(found[2]), unit)
        got = got * scale if scale is not None else None
    if got is None:
        return f"Write a number{f' in {in_words(unit)}' if unit else ''}, without quotes or unit."
    return f"Write {key} = {got:.9g}, without quotes or unit."


def _number_in(text: str) -> float | None:
    """Return the number; None for 1,234, which is a thousand to some and one and a bit to others."""
    if re.search(r",\d{3}$", text):
        return None
    value = float(text.replace(",", "."))
    return value if math.isfinite(value) else None


def _other_unit(key: str, value: Any, known: list[str]) -> str:
    """Recognise the right quantity in the wrong unit, and a period given instead of a rate."""
    stem, unit = split_unit(key)
    got = _as_float(value)
    seconds = factor(unit, "s")
    if stem in _PERIOD_NAMES and "rate_hz" in known and (not unit or seconds is not None):
        period = got * (seconds or math.nan)
        return f"The rate is given instead: rate_hz{f' = {1 / period:.9g}' if period > 0 else ''}."
    for other in known:
        other_stem, wanted = split_unit(other)
        if other_stem == stem and wanted:
            scale = factor(unit, wanted)
            shown = f" = {got * scale:.9g}" if scale is not None and math.isfinite(got) else ""
            return f"It is given in {in_words(wanted)}: {other}{shown}."
    return ""


def _as_float(value: Any) -> float:
    """Return a number as float; NaN for anything else, and for what no float can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan


def _other_home(path: tuple[str, ...], key: str) -> str:
    """Return where exactly this key exists: in another kind of the table, or in another table."""
    here = path[0] if len(path) > 1 else ""
    kinds = [kind for kind, model in KINDS.get(here, {}).items() if key in model.model_fields]
    if kinds:
        shown = ['"module:Class"' if kind == "custom" else toml_value(kind) for kind in kinds]
        return f"It belongs to kind = {' or '.join(shown)}."
    if here and key in Rig.model_fields and key not in _tables():
        return "It belongs above the first [table]."
    homes = [
        f"[{name}]"
        for name, models in _tables().items()
        if name != here and any(key in model.model_fields for model in models)
    ]
    return f"It belongs in {' or '.join(homes)}." if homes else ""


def _tables() -> dict[str, list[type[BaseModel]]]:
    tables: dict[str, list[type[BaseModel]]] = {}
    for name, field in Rig.model_fields.items():
        if name in KINDS:
            tables[name] = list(KINDS[name].values())
        elif isinstance(field.annotation, type) and hasattr(field.annotation, "model_fields"):
            tables[name] = [field.annotation]
    return tables


def _other_spelling(key: str, known: list[str]) -> str:
    """Compare whole keys, then keys without their units."""
    stems = {split_unit(other)[0]: other for other in known}
    by_stem = did_you_mean(split_unit(key)[0], stems, shown=lambda stem: stems[stem])
    return did_you_mean(key, known, by_stem, shown=str)
