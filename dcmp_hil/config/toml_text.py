"""TOML text: read with messages that show the line and say what usually is wrong with such a line."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from dcmp_hil.config.formatting import dotted, printable
from dcmp_hil.errors import ConfigError

_NAME_CHARS_MAX = 60
_SHOWN_LINE_CHARS_MAX = 60


def parse(text: str, place: str) -> dict[str, Any]:
    """Read the text of a rig file.

    Raises
    ------
    ConfigError
        If it is no TOML: the place, the line, and the likely remedy.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{place}: not TOML: {_explained(str(error), text)}") from None
    except RecursionError:
        raise ConfigError(f"{place}: not TOML: nested too deeply. Remove brackets.") from None
    except ValueError as error:  # a whole number of thousands of digits, a date that does not exist
        raise ConfigError(
            f"{place}: a value that cannot be read: {_first_words(error)}. Look for an endless number."
        ) from None


def parse_value(text: str) -> Any:
    """Read one TOML value; what is none is taken as text."""
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text.strip()
    return table["value"] if len(table) == 1 else text.strip()  # a line break would smuggle in more keys


def name_from(stem: str) -> str:
    """Make a rig's name of a file's."""
    return re.sub(r"[^\w.-]+", "-", stem).lstrip(".-")[:_NAME_CHARS_MAX] or "rig"


def _explained(fault: str, text: str) -> str:
    names = re.search(r"\((.*)\) twice", fault)
    if names:
        parts = re.findall(r"'([^']*)'", names[1])
        fault = fault.replace(f"({names[1]})", f"[{dotted(parts)}]")
    found = re.search(r"line (\d+)", fault)
    lines = text.splitlines()
    if not found or not 0 < int(found[1]) <= len(lines):
        return f"{fault}. {_remedy('')}"
    line = lines[int(found[1]) - 1].strip()
    shown = printable(line[:_SHOWN_LINE_CHARS_MAX])
    return f"{fault}: `{shown}`. {_remedy(line)}" if line else f"{fault}. {_remedy('')}"


def _remedy(line: str) -> str:
    _, equals, value = line.partition("=")
    value = value.partition("#")[0].strip()
    if line.startswith("[") and "]" not in line:
        return "A table needs both brackets, as in [loop]."
    if equals and re.match(r"[-+]?\d+,\d", value):
        return "Write a decimal point, not a comma."
    if equals and re.match(r"[-+]?[\d.]+\s*[^\W\d]", value):
        return "Write the number without its unit; the unit is part of the key."
    if equals and re.match(r"[^\W\d]", value):
        return 'Text needs quotes, as in kind = "sine".'
    return "Write KEY = VALUE, one a line, text in quotes, tables in [brackets], each only once."


def _first_words(error: ValueError) -> str:
    return str(error).partition(";")[0].partition(":")[0]
