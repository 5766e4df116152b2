"""Words that may follow on a command line, read from the commands themselves and from the rig's schema."""

from __future__ import annotations

import json
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from dcmp_hil import fault_hooks
from dcmp_hil.config import shipped_rigs
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.schema import rig_schema
from dcmp_hil.conformance.registry import CHECKS

if TYPE_CHECKING:
    from collections.abc import Mapping

_ANY_FILE, _RIG_FILE = "*", "*.toml"
_FILES = ("FILE", "FILE.rrd", "DIR", "PATH", "RUN", "PORT")
_CHANGED_IN_A_RUN = ("controller", "observer", "reference")
_COMPARED = ("controller", "model", "observer")


class Values(NamedTuple):
    """Values of an option or an argument.

    Parameters
    ----------
    words
        Whole values. `KEY=` and `KEY=VALUE` are two words: a shell shows the second after the first.
    files
        Pattern of file names that are values, too; empty for none.
    """

    words: tuple[str, ...] = ()
    files: str = ""


class Option(NamedTuple):
    """An option: its spellings, its values (None for a flag), and its help in one line."""

    names: tuple[str, ...]
    values: Values | None
    help: str


class Command(NamedTuple):
    """A command: its name, its line in the list, its options, and the values of its arguments."""

    name: str
    summary: str
    options: tuple[Option, ...]
    argument: Values


def commands(found: Mapping[str, Any]) -> list[Command]:
    """Return what may follow each command.

    Parameters
    ----------
    found
        The commands by name, as typer has them.
    """
    return [_command(name, command) for name, command in found.items()]


def _command(name: str, command: Any) -> Command:
    options = [one for one in command.params if one.opts[0].startswith("-")]
    arguments = [one for one in command.params if not one.opts[0].startswith("-")]
    return Command(
        name,
        command.short_help,
        (*(_option(name, one) for one in options), Option(("--help", "-h"), None, "Show the help.")),
        _values(name, arguments[0]) if arguments else Values(),
    )


def _option(command: str, option: Any) -> Option:
    return Option(
        tuple(option.opts),
        None if option.is_flag else _values(command, option),
        option.help.partition(". ")[0].rstrip("."),
    )


def _values(command: str, parameter: Any) -> Values:
    """Return the values of an option or argument; what its help calls it says what they are."""
    metavar = parameter.metavar
    if metavar in _FILES:
        return Values(files=_ANY_FILE)
    if metavar == "RIG":
        return Values(tuple(shipped_rigs()), _RIG_FILE)
    if metavar == "SPEC.toml":
        return Values(files=_RIG_FILE)
    words: Mapping[str, Any] = {
        "KEY=VALUE": lambda: _keys(command, parameter.opts[0]),
        "KIND:...": _faults,
        "CHECK": lambda: [check.name for check in CHECKS],
        "NAME FILE": shipped_rigs,
    }
    if metavar in words:
        return Values(tuple(words[metavar]()))
    if parameter.opts[0] == "--observer" or metavar == "OBSERVERS":
        return Values(_kinds("observer"))
    return Values(_choices(parameter.type_descriptor.annotation))


def _choices(annotation: object) -> tuple[str, ...]:
    for one in (annotation, *get_args(annotation)):
        if isinstance(one, type) and issubclass(one, Enum):
            return tuple(str(member.value) for member in one)
    return ()


def _kinds(table: str) -> tuple[str, ...]:
    return tuple(kind for kind in KINDS[table] if kind != "custom")


def _keys(command: str, option: str) -> list[str]:
    """Return `KEY=` of each key that an option takes, and `KEY=VALUE` of those with a list of values."""
    schema, found = rig_schema(), dict[str, list[Any]]()
    _collect(schema, "", schema["$defs"], found)
    words = [*_kinds("observer")] if option == "--compare" else []
    tables = _COMPARED if option == "--compare" else tuple(schema["properties"])
    names = _changed_in_a_run() if command == "set" else found.keys()
    for key, values in found.items():
        if key in names and key.partition(".")[0] in tables:
            words.append(f"{key}=")
            words += [f"{key}={one if isinstance(one, str) else json.dumps(one)}" for one in values]
    return words


def _changed_in_a_run() -> set[str]:
    """Return the keys that some rig can change while it runs."""
    return {
        f"{table}.{key}"
        for table in _CHANGED_IN_A_RUN
        for kind in _kinds(table)
        for key in KINDS[table][kind].tunable()  # type: ignore[attr-defined]
    }


def _collect(
    node: Mapping[str, Any], path: str, definitions: Mapping[str, Any], into: dict[str, Any]
) -> None:
    """Add the keys below a node of the schema, with the values that are listed."""
    if "$ref" in node:
        node = definitions[node["$ref"].rpartition("/")[2]]
    branches = (*node.get("oneOf", ()), *node.get("anyOf", ()))
    for one in branches:
        _collect(one, path, definitions, into)
    for key, inner in node.get("properties", {}).items():
        _collect(inner, f"{path}.{key}" if path else key, definitions, into)
    if not branches and node.get("type") != "object":
        values = into.setdefault(path, [])
        listed = [*node.get("enum", ()), *([node["const"]] if "const" in node else ())]
        values += [one for one in (*listed, *_booleans(node)) if one not in values]


def _booleans(node: Mapping[str, Any]) -> tuple[bool, ...]:
    return (True, False) if node.get("type") == "boolean" else ()


def _faults() -> list[str]:
    """Return the kinds of fault, and `KIND:KEY=` of each key of each kind."""
    words = []
    for kind, keys in fault_hooks.kinds().items():
        words += [kind, *(f"{kind}:{key}=" for key in keys)]
    return words
