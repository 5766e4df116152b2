"""One shared environment for each worker."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.walk.world import World

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(scope="session")
def world(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """Yield the files, ports and runs that the commands need."""
    with tempfile.TemporaryDirectory(prefix="dcmp", dir="/tmp") as runtime:  # a socket's path is short
        made = World(installed, tmp_path_factory.mktemp("world"), Path(runtime))
        with made.stack:
            yield made
