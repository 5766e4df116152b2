"""The core, built once, or the build that the gates chose."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.firmware.bench import Core
from tests.firmware.core_library import PREBUILT, build, load


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out, in the gates' slow builds, what does not use the library: it was asked before."""
    if PREBUILT not in os.environ:
        return
    unused = [item for item in items if "core" not in getattr(item, "fixturenames", ())]
    config.hook.pytest_deselected(items=unused)
    items[:] = [item for item in items if item not in unused]


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    built = os.environ.get(PREBUILT)
    library = Path(built) if built else build(tmp_path_factory.mktemp("core"), "plain")
    return Core(*load(library))
