"""The boards with a chip, built once a worker."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.target.build import build

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="session")
def f405(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the ELF files."""
    return build(tmp_path_factory.mktemp("f405"), "f405")[0]
