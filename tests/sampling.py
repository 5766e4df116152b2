"""Of tests marked `sampled`, `--sample N` runs one in N of each function's cases, others for every text.

A function of many cases, each seconds long and all passing, is asked in part at every commit and wholly by
`make test`.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

MARKER = "sampled"


def chosen(names: Sequence[str], one_in: int, text: str) -> set[str]:
    """Return one in `one_in` of some names, rounded up, drawn by a text."""
    count = -(-len(names) // one_in)
    return set(sorted(names, key=lambda name: hashlib.sha256(f"{text} {name}".encode()).digest())[:count])
