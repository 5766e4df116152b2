"""What the pages name exists: test files, make targets, exit codes, and the headings that links lead to."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dcmp_hil.errors import ExitCode

_ROOT = Path(__file__).parents[1]
_PAGES = sorted([*_ROOT.glob("*.md"), _ROOT / "firmware" / "README.md", *_ROOT.glob("docs/*.md")])
_TARGETS = set(re.findall(r"^([a-z-]+):", (_ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))


def _anchors(text: str) -> set[str]:
    """Return the anchors that a Markdown viewer makes of the headings."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", _PAGES, ids=lambda page: str(page.relative_to(_ROOT)))
def test_what_a_page_names_is_there(page: Path) -> None:
    text = page.read_text("utf-8")
    missing = [name for name in re.findall(r"`(tests/[\w/.]+?)/?`", text) if not (_ROOT / name).exists()]
    missing += [name for name in re.findall(r"`make ([a-z-]+)", text) if name not in _TARGETS]
    for target, anchor in re.findall(r"\]\(([^)#:]*)#?([^)]*)\)", text):
        if target in ("http", "https"):
            continue
        other = page.parent / target if target else page
        if not other.exists() or (anchor and anchor not in _anchors(other.read_text("utf-8"))):
            missing.append(f"{target}#{anchor}")
    assert not missing


def test_page_of_the_commands_lists_every_exit_code() -> None:
    text = (_ROOT / "docs" / "cli.md").read_text("utf-8")
    table = text.partition("## Exit codes")[2].partition("\n## ")[0]
    listed = {int(code) for code in re.findall(r"^\| (\d+) \|", table, re.MULTILINE)}
    assert listed | {ExitCode.INTERRUPTED} == set(ExitCode)
    assert f"{ExitCode.INTERRUPTED:d}: a second Ctrl-C" in table
