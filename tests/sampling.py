"""What is drawn of the tests by a text, such as a commit: others for every text.

Of tests marked `sampled`, `--sample N` runs one in N of each function's cases: a function of many cases,
each seconds long and all passing, is asked in part at every commit and wholly by `make test`.
`--sample-files N` runs one in N of each folder's files: what was asked wholly under one Python is asked in
part under the next, but for the rooms in which Pythons differ most.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

MARKER = "sampled"
WHOLE = ("install", "ipc", "platform", "plugins")
"""Folders of which no file is left out: packages, processes, signals and syntax trees."""


def chosen(names: Sequence[str], one_in: int, text: str) -> set[str]:
    """Return one in `one_in` of some names, rounded up, drawn by a text."""
    count = -(-len(names) // one_in)
    return set(sorted(names, key=lambda name: hashlib.sha256(f"{text} {name}".encode()).digest())[:count])


def file_is_drawn(path: Path, one_in: int, text: str) -> bool:
    """Tell whether a file of tests is among one in `one_in` of those of its folder, drawn by a text."""
    if path.parent.name in WHOLE:
        return True
    beside = [file.name for file in path.parent.glob("test_*.py")]
    return path.name in chosen(beside, one_in, f"{text} {path.parent.name}")
