"""Edits of a rig file's text that keep every other line as it is."""

from __future__ import annotations

import copy
import re
from typing import TYPE_CHECKING, Any

from dcmp_hil.config.formatting import toml_value
from dcmp_hil.config.overrides import apply_overrides
from dcmp_hil.config.toml_text import parse
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence

_HEADER = re.compile(r"\s*\[\s*([\w-]+)\s*\]\s*(#.*)?")
_PAIR = re.compile(r"""(\s*([\w-]+)\s*=\s*)("(?:[^"\\]|\\.)*"|'[^']*'|[^\s#"']+)(\s*)(\#.*)?""")


def edited_text(text: str, overrides: Sequence[str], place: str) -> str:
    """Return the text of a rig file after overrides.

    A line is changed behind its `=`; its comment stays, in its column where the value leaves room. A line
    goes, with its comment, where the new kind of a table does not know its key. A new key comes behind the
    last one of its table, and its line ends as the one before it. The result is read again and compared with
    what the overrides make of the file.

    Parameters
    ----------
    text
        A rig file, with any ends of lines, also mixed ones.
    overrides
        `key=value` in dotted form; of keys in tables.
    place
        What to call the file.

    Raises
    ------
    ConfigError
        If the text is no TOML, or is written in a way that this does not edit (tables in one line, dotted
        keys, values over several lines).
    """
    before = parse(text, place)
    after = copy.deepcopy(before)
    apply_overrides(after, overrides)
    lines = text.split("\n")  # each with the "\r" of its own end
    lines[-1] += _end_behind(lines, len(lines) - 1)  # it has none, and is not the last one if keys follow
    for table, section in after.items():
        if isinstance(section, dict):
            old = before.get(table, {})
            _edit(lines, table, old if isinstance(old, dict) else {}, section)
    result = "\n".join(lines).removesuffix("\r")
    if not _holds(result, after):
        raise ConfigError(
            f"{place}: its layout cannot be edited here. Write the values into it: {', '.join(overrides)}."
        )
    return result


def _holds(text: str, table: dict[str, Any]) -> bool:
    """Return whether a text is TOML with that content."""
    try:
        return parse(text, "") == table
    except ConfigError:
        return False


def _edit(lines: list[str], table: str, old: dict[str, Any], new: dict[str, Any]) -> None:
    """Edit the lines of one table."""
    for key in old.keys() - new.keys():
        at = _line_of(lines, table, key)
        if at is not None:
            del lines[at]
    for key, value in new.items():
        if key in old and old[key] == value:
            continue
        at = _line_of(lines, table, key)
        if at is not None:
            lines[at] = _with_value(lines[at], toml_value(value))
        else:
            at = _end_of(lines, table)
            lines.insert(at, f"{key} = {toml_value(value)}{_end_behind(lines, at)}")


def _lines_of(lines: list[str], table: str) -> range | None:
    """Return the places of the lines of a table, its header first; None if it has no header."""
    start = None
    for at, line in enumerate(lines):
        found = _HEADER.fullmatch(line)
        if start is not None and (found or line.lstrip().startswith("[")):
            return range(start, at)
        if start is None and found and found[1] == table:
            start = at
    return None if start is None else range(start, len(lines))


def _line_of(lines: list[str], table: str, key: str) -> int | None:
    for at in _lines_of(lines, table) or ():
        found = _PAIR.fullmatch(lines[at])
        if found and found[2] == key:
            return at
    return None


def _end_of(lines: list[str], table: str) -> int:
    """Return where a new line of a table goes; its header is added where there is none."""
    own = _lines_of(lines, table)
    if own is None:
        while lines and not lines[-1].strip():
            lines.pop()
        lines += [f"{line}{_end_behind(lines, len(lines))}" for line in ("", f"[{table}]", "")]
        return len(lines) - 1
    return 1 + max(at for at in own if at == own.start or _PAIR.fullmatch(lines[at]))


def _end_behind(lines: list[str], at: int) -> str:
    """Return the carriage return at the end of the line before a place, if it has one."""
    return "\r" if at and lines[at - 1].endswith("\r") else ""


def _with_value(line: str, value: str) -> str:
    """Return a line with another value; its comment keeps its column if it can."""
    found = _PAIR.fullmatch(line)
    assert found is not None  # noqa: S101 - `_line_of` found it so
    start, _, old, gap, comment = found.groups()
    if not comment:
        return f"{start}{value}" + ("\r" if line.endswith("\r") else "")
    return f"{start}{value.ljust(len(old) + len(gap) - 1)} {comment}"
