"""Report on the mutants, compared with the names of those that may survive."""

from __future__ import annotations

import tomllib
from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from tools.mutants.generate import Mutant
    from tools.mutants.trials import Verdict

Key = tuple[str, str, str, str, int]
COLUMNS = ("mutants", "tests", "time", "dropped", "named", "survived")


def names(path: Path) -> dict[Key, str]:
    """Read which mutants may live, and why.

    Raises
    ------
    RuntimeError
        If an entry lacks something, says it twice, or gives no reason.
    """
    found: dict[Key, str] = {}
    for entry in tomllib.loads(path.read_text("utf-8")).get("mutant", []):
        try:
            key = (entry["file"], entry["where"], entry["line"], entry["becomes"], entry.get("number", 1))
            why = entry["why"].strip()
        except KeyError as missing:
            raise RuntimeError(f"{path.name}: an entry without {missing}: {entry}") from missing
        if key in found or not why:
            raise RuntimeError(f"{path.name}: named twice, or without a reason: {entry}")
        found[key] = why
    return found


def says(mutant: Mutant) -> str:
    """Return the name of a mutant as in `mutants.toml`."""
    number = f"number = {mutant.number}\n" if mutant.number > 1 else ""
    fields = (
        ("file", mutant.file),
        ("where", mutant.where),
        ("line", mutant.line),
        ("becomes", mutant.becomes),
    )
    return "[[mutant]]\n" + "".join(f"{name} = '''{value}'''\n" for name, value in fields) + number


def complaints(named: Mapping[Key, str], every: Iterable[Mutant], found: Sequence[Verdict]) -> list[str]:
    """Return what is wrong: survivors without a name, and names without a survivor."""
    exist = {mutant.key for mutant in every}
    wrong = [f"named, but there is no such mutant any more:\n{key}" for key in named if key not in exist]
    for verdict in found:
        mutant, lives = verdict.mutant, verdict.what == "survived"
        if lives and mutant.key not in named:
            wrong.append(f"no test notices line {mutant.row}:\n{says(mutant)}")
        elif not lives and mutant.key in named:
            wrong.append(f"named, but {verdict.what} ({verdict.by}):\n{says(mutant)}")
    return wrong


def _row(name: str, found: Sequence[Verdict], named: Mapping[Key, str]) -> str:
    counted = Counter(verdict.what for verdict in found)
    alive = [verdict for verdict in found if verdict.what == "survived"]
    known = sum(verdict.mutant.key in named for verdict in alive)
    figures = {**counted, "mutants": len(found), "named": known, "survived": len(alive) - known}
    return f"| {name:20} |" + "".join(f"{figures.get(column, 0):>9} |" for column in COLUMNS)


def table(found: Sequence[Verdict], named: Mapping[Key, str]) -> str:
    """Return a row for each file and one for all."""
    files = list(dict.fromkeys(verdict.mutant.file for verdict in found))
    head = f"| {'file':20} |" + "".join(f"{column:>9} |" for column in COLUMNS)
    lines = [head, f"|{'-' * 22}|" + f"{'-' * 9}:|" * len(COLUMNS)]
    lines += [_row(name, [each for each in found if each.mutant.file == name], named) for name in files]
    reasons = Counter(verdict.by for verdict in found if verdict.what == "dropped")
    left_out = ", ".join(f"{count} {reason}" for reason, count in sorted(reasons.items())) or "none"
    return "\n".join([*lines, _row("all", found, named), "", f"Dropped: {left_out}."]) + "\n"


def page(found: Sequence[Verdict], named: Mapping[Key, str], wrong: Sequence[str], took_s: float) -> str:
    """Return the report: the table, what is wrong, who may live and why."""
    parts = [f"# Mutants of the safety C\n\n{table(found, named)}\n{took_s:.0f} s\n"]
    if wrong:
        parts.append("\n## Wrong\n\n" + "".join(f"```\n{each}\n```\n" for each in wrong))
    parts.append("\n## Named\n\n")
    for (file, where, line, becomes, _), why in named.items():
        parts.append(f"- {file}, {where}: `{line}` -> `{becomes}`\n  {why}\n")
    return "".join(parts)
