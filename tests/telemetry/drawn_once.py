"""Pictures that every test of a module reads: the workers of a test run draw them once."""

from __future__ import annotations

import fcntl
import json
import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import pytest


def drawn_once(
    factory: pytest.TempPathFactory, name: str, draw: Callable[[Path], dict[str, Any]]
) -> tuple[Path, dict[str, Any]]:
    """Return a folder of pictures, and what was said of them; draw them unless another worker did.

    Parameters
    ----------
    factory
        Of the test run, whose workers share the folder.
    name
        Of the pictures.
    draw
        Draws them into a folder, and returns what JSON can keep.
    """
    base = factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = shared / "drawn" / name
    folder.mkdir(parents=True, exist_ok=True)
    said = folder / "said.json"
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not said.exists():
            said.write_text(json.dumps(draw(folder)))
    found: dict[str, Any] = json.loads(said.read_text())
    return folder, found
