"""Files that pages and tools name are there."""

from __future__ import annotations

import re
from pathlib import Path

from tools.mutants.trials import TESTS

_ROOT = Path(__file__).parents[2]
_PATH = re.compile(r"\b(?:tests|tools|dcmp_hil|sim_backend|firmware)/[\w/-]+\.(?:py|c|h|toml|md|dbc|cmake)\b")


def test_every_file_that_a_page_names_is_there() -> None:
    pages = [
        *_ROOT.glob("*.md"),
        *_ROOT.glob("docs/**/*.md"),
        *_ROOT.glob("firmware/*.md"),
        _ROOT / "Makefile",
    ]
    named = {(page.name, path) for page in pages for path in _PATH.findall(page.read_text("utf-8"))}
    assert len(named) > 20
    of_history = {"CHANGELOG.md", *(page.name for page in _ROOT.glob("docs/decisions/*.md"))}
    assert [one for one in sorted(named) if one[0] not in of_history and not (_ROOT / one[1]).exists()] == []


def test_every_module_that_is_to_notice_a_mutant_is_there() -> None:
    assert [path for path in TESTS if not Path(path).is_file()] == []
