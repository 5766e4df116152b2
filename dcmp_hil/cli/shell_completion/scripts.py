"""The scripts themselves: tables of words around a few functions in the shell's own language.

They know all words from the beginning: completing starts no program, opens nothing and writes nothing.
"""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.cli.shell_completion.table import Command, Option, Values

_HEADING = "# Completion of dcmp-hil for {0}, made by `dcmp-hil completion {0}`; see docs/cli.md.\n"
_BACKSLASH_IN_FISH = str.maketrans({"\\": r"\\", "'": r"\'"})


class _Words:
    """Lists of words, each once, by number."""

    def __init__(self) -> None:
        self.numbers: dict[tuple[str, ...], int] = {}

    def number(self, words: tuple[str, ...]) -> int:
        """Return the number of a list."""
        return self.numbers.setdefault(words, len(self.numbers) + 1)


def bash(commands: Sequence[Command]) -> str:
    """Return the script for bash 4.3 and newer."""
    return _HEADING.format("bash") + _posix(commands) + "\n" + _part("bash.sh")


def zsh(commands: Sequence[Command]) -> str:
    """Return the script for zsh."""
    return "#compdef dcmp-hil\n" + _HEADING.format("zsh") + _posix(commands) + "\n" + _part("zsh.sh")


def fish(commands: Sequence[Command]) -> str:
    """Return the script for fish 3."""
    words, lines = _Words(), list[str]()
    for command in commands:
        after = f"-n '__fish_seen_subcommand_from {command.name}'"
        lines += [
            f"complete -c dcmp-hil -n __fish_use_subcommand -a {command.name} -d {_in_fish(command.summary)}",
            *(f"complete -c dcmp-hil {after} {_fish_option(option, words)}" for option in command.options),
        ]
        if command.argument.words or command.argument.files:
            lines.append(f"complete -c dcmp-hil {after} {_fish_values(command.argument, words)}")
    lists = [
        f"        case {number}\n            printf '%s\\n' {' '.join(map(_in_fish, listed))}"
        for listed, number in words.numbers.items()
    ]
    return _HEADING.format("fish") + _part("fish.fish").replace("@WORDS@", "\n".join(lists)) + _lines(lines)


SCRIPTS: dict[str, Callable[[Sequence[Command]], str]] = {"bash": bash, "zsh": zsh, "fish": fish}
"""By shell."""


def _posix(commands: Sequence[Command]) -> str:
    """Return the tables and functions that bash and zsh have in common."""
    words, follows, options = _Words(), list[str](), list[str]()
    for command in commands:
        follows.append(_case(f"{command.name} ", command.argument, words))
        for option in command.options:
            if option.values is not None:
                follows += [_case(f"{command.name} {name}", option.values, words) for name in option.names]
        names = [name for option in command.options for name in option.names]
        options.append(f"    ({command.name}) reply=({' '.join(names)}) ;;")
    lists = [
        f"    ({number}) reply=({' '.join(map(_quoted, listed))}) ;;"
        for listed, number in words.numbers.items()
    ]
    filled = {
        "@WORDS@": "\n".join(lists),
        "@FOLLOWS@": "\n".join(follows),
        "@OPTIONS@": "\n".join(options),
        "@COMMANDS@": " ".join(command.name for command in commands),
    }
    text = _part("words.sh")
    for mark, value in filled.items():
        text = text.replace(mark, value)
    return text


def _case(place: str, values: Values, words: _Words) -> str:
    listed = f"_dcmp_hil_words {words.number(values.words)}; " if values.words else ""
    return f"    ({_quoted(place)}) {listed}files={_quoted(values.files)} ;;"


def _fish_option(option: Option, words: _Words) -> str:
    names = [f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in option.names]
    values = "" if option.values is None else f" {_fish_values(option.values, words) or '-x'}"
    return f"{' '.join(names)}{values} -d {_in_fish(option.help)}"


def _fish_values(values: Values, words: _Words) -> str:
    """Return what says the values of an option or argument; `-r` and `-x`: there must be one, `-F`: files."""
    listed = f"-a '(__dcmp_hil_find {words.number(values.words)})'" if values.words else ""
    if values.files:
        return f"-r -F {listed}".rstrip()
    return f"-x {listed}".rstrip()


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "'\\''") + "'"


def _in_fish(text: str) -> str:
    return f"'{text.translate(_BACKSLASH_IN_FISH)}'"


def _lines(lines: Sequence[str]) -> str:
    return "\n".join((*lines, ""))


def _part(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text("utf-8")
