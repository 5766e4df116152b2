"""The programs for a chip, built once a worker."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.target.build import build
from tests.target.chip_image import build_image, build_library

if TYPE_CHECKING:
    import ctypes
    from pathlib import Path


@pytest.fixture(scope="session")
def f405(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the ELF files."""
    return build(tmp_path_factory.mktemp("f405"), "f405")[0]


@pytest.fixture(scope="session")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the program with the law in single precision."""
    return build_image(tmp_path_factory.mktemp("image"))


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """Return the same for this computer."""
    return build_library(tmp_path_factory.mktemp("library"))
