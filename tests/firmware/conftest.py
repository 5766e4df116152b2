"""The core, built once, or the build that the gates chose."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.firmware.bench import Core
from tests.firmware.core_library import PREBUILT, build, load


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    built = os.environ.get(PREBUILT)
    library = Path(built) if built else build(tmp_path_factory.mktemp("core"), "plain")
    return Core(*load(library))
