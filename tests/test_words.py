"""Plain English: no vague words in code and pages."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_ROOT = Path(__file__).parents[1]
_VAGUE = re.compile(
    r"(?<![a-z])("
    r"whoever|whomever|whatever|wherever|nobody|somebody|anybody|everybody|someone|anyone|everyone|somewhere"
    r"|luck|luckily|lucky|befall|befalls|befallen|befell|onlookers?|lookers?[-_ ]on"
    r"|(look|looks|looked|looking|hand|hands|handed|handing)[-_ \n]+on"
    r")(?![a-z])",
    re.IGNORECASE,
)
"""Words and phrases without a named subject; in identifiers (`hand_on`) as well."""

_VAGUE_CONSTANTS = frozenset(
    re.findall(
        r"\w+",
        """
        AGAIN ANSWER ANSWERS BUSY CLOSING COMING_UP ENOUGH FAR FARTHEST FASTEST FEW FEWEST HELD HERE
        HIGHEST KEPT LARGE LARGEST LAST LATE LEAST LEAVING LONGEST LOOK LOOKS MANY MOST NEAR NEWEST NONE
        NOTHING NOWHERE ODD OFF PATIENCE QUIET REST ROOM ROUND SHORTEST SHOWN SLOW SLOWEST SMALL SMALLEST
        SOME SURE TAKEN TRIES WAITING
        """,
    )
)
"""Names of one word that say neither what they bound nor in which unit."""

_CODE = {".py", ".c", ".h", ".cmake", ".ld", ".dbc", ".toml", ".html", ".js", ".css"}


def _vague_words(text: str) -> list[str]:
    """Return the vague words of a text, in order."""
    return [found[0] for found in _VAGUE.finditer(text)]


def _code() -> Iterator[Path]:
    """Yield every source file but this one, which has the list."""
    yield _ROOT / "pyproject.toml"
    yield _ROOT / "Makefile"
    for room in ("dcmp_hil", "sim_backend", "firmware", "tools", "tests"):
        for path in sorted((_ROOT / room).rglob("*")):
            if path.suffix in _CODE and path != Path(__file__):
                yield path


def _pages() -> Iterator[Path]:
    """Yield every page in Markdown."""
    yield from sorted(_ROOT.glob("*.md"))
    for room in ("docs", "firmware", "dcmp_hil", "tests"):
        yield from sorted((_ROOT / room).rglob("*.md"))


@pytest.mark.parametrize("files", [_code, _pages], ids=["code", "pages"])
def test_there_are_no_vague_words(files: Callable[[], Iterator[Path]]) -> None:
    lines, found = 0, list[str]()
    for path in files():
        text = path.read_text("utf-8")
        lines += text.count("\n")
        found += [f"{path.relative_to(_ROOT)}: {word}" for word in _vague_words(text)]
    assert lines > 2000
    assert not found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Whoever listens, and nobody else.", ["Whoever", "nobody"]),
        ("def test_nobody_answers(", ["nobody"]),
        ("rows are handed on\n", ["handed on"]),
        ("a looker-on", ["looker-on"]),
        ("_NOBODY = 0", ["NOBODY"]),
        ("whichever is longer; plucked", []),
    ],
)
def test_the_count_finds_vague_words(text: str, expected: list[str]) -> None:
    assert _vague_words(text) == expected


def _constants(source: str) -> Iterator[str]:
    """Yield the private constants of a module, without the underscore in front."""
    for statement in ast.parse(source).body:
        for node in ast.walk(statement) if isinstance(statement, ast.Assign | ast.AnnAssign) else ():
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id.startswith("_"):
                yield node.id[1:]


def test_no_constant_is_one_vague_word() -> None:
    found = [
        f"{path.relative_to(_ROOT)}: _{name}"
        for room in ("dcmp_hil", "sim_backend")
        for path in sorted((_ROOT / room).rglob("*.py"))
        for name in _constants(path.read_text("utf-8"))
        if name in _VAGUE_CONSTANTS
    ]
    assert found == []


def test_the_constants_of_a_module_are_found() -> None:
    source = "_LOOK = 0.1\n_FEW, _MOST = 1, 2\n_LATE: int = 3\ndef f() -> None:\n    _SLOW = 1\n"
    assert list(_constants(source)) == ["LOOK", "FEW", "MOST", "LATE"]


_PRONOUN = re.compile(r"(What|Who|How|Where|It|They|This|That|These|Those|Everything)\b")
"""Beginnings of a summary that name neither a thing nor an action."""


def _summaries(source: str) -> Iterator[str]:
    """Yield the first line of every docstring of a module, its classes and functions."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield (ast.get_docstring(node) or "").partition("\n")[0]


def test_summaries_begin_with_a_thing_or_an_action() -> None:
    found = [
        f"{path.relative_to(_ROOT)}: {summary}"
        for room in ("dcmp_hil", "sim_backend", "tools")
        for path in sorted((_ROOT / room).rglob("*.py"))
        for summary in _summaries(path.read_text("utf-8"))
        if _PRONOUN.match(summary)
    ]
    assert found == []


def test_summaries_of_a_module_are_found() -> None:
    source = '"""What it is."""\nclass A:\n    """A thing.\n\n    It is more."""\ndef f():\n    """Do."""\n'
    assert list(_summaries(source)) == ["What it is.", "A thing.", "Do."]
