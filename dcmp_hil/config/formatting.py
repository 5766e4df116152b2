"""Keys, values and what is allowed of them, in words that are safe to print."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from dcmp_hil.common.number_range import NumberRange, number

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_SHOWN_CHARS_MAX = 60  # characters of a key or a value that are shown
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
_TYPE_NAMES = {
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "string": "text",
}


def toml_value(value: Any) -> str:
    """Return a value in TOML's syntax, shortened."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, str):
        text = _quoted(value)
    elif isinstance(value, dict):
        text = "a table"
    elif isinstance(value, list):
        text = "a list"
    elif isinstance(value, float):
        text = number(value)
    else:
        text = str(value)
    return _shortened(text)


def dotted(parts: Iterable[str]) -> str:
    """Write a key in dotted form; what is no bare key is quoted, as TOML wants it."""
    return ".".join(
        _shortened(part if re.fullmatch(r"[\w-]+", part) and part.isprintable() else _quoted(part))
        for part in parts
    )


def describe(schema: Mapping[str, Any]) -> str:
    """Return in words what a JSON schema of one value allows."""
    if "anyOf" in schema:
        return " or ".join(describe(one) for one in schema["anyOf"] if one.get("type") != "null")
    if "const" in schema:
        return toml_value(schema["const"])
    if "enum" in schema:
        return " or ".join(toml_value(value) for value in schema["enum"])
    if schema.get("type") == "integer" and (schema.get("minimum"), schema.get("maximum")) == (0, 1):
        return "0 or 1"
    examples = schema.get("examples")
    such_as = f" such as {toml_value(examples[0])}" if examples else ""
    return f"{range_of(schema).words(what=_TYPE_NAMES.get(str(schema.get('type')), 'a table'))}{such_as}"


def range_of(schema: Mapping[str, Any]) -> NumberRange:
    """Return the bounds that a JSON schema of one number gives."""
    return NumberRange(
        float(schema.get("exclusiveMinimum", schema.get("minimum", -math.inf))),
        float(schema.get("exclusiveMaximum", schema.get("maximum", math.inf))),
        low_excluded="exclusiveMinimum" in schema,
        high_excluded="exclusiveMaximum" in schema,
    )


def printable(text: str) -> str:
    """Return `text` with every character escaped that a terminal would obey instead of showing."""
    return "".join(_visible(char) for char in text)


def _shortened(text: str) -> str:
    return text if len(text) <= _SHOWN_CHARS_MAX else text[: _SHOWN_CHARS_MAX - 3] + "..."


def _quoted(text: str) -> str:
    """Return text as a quoted TOML string."""
    return '"' + "".join(_ESCAPES.get(char) or _visible(char) for char in text) + '"'


def _visible(char: str) -> str:
    if char.isprintable():
        return char
    code = ord(char)
    return f"\\u{code:04x}" if code <= 0xFFFF else f"\\U{code:08x}"  # noqa: PLR2004 - what \u can write
