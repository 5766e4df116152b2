"""Fixtures: a viewer that can draw; no process and no shared memory stays behind."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.telemetry.rerun import viewer as window
from tests.telemetry.sinks import children
from tools.screenshot import APT

if TYPE_CHECKING:
    from collections.abc import Iterator


_DRIVERS = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))


@pytest.fixture(scope="session")
def vulkan() -> None:
    """Skip without a viewer that can draw, saying how to get it; under CI that is a failure.

    It is of the widest scope, so that it comes before what draws pictures for a whole module.
    """
    missing = not any(folder.is_dir() and any(folder.iterdir()) for folder in _DRIVERS)
    if not (missing or not window.viewer_binary().exists()):
        return
    if os.environ.get("CI") == "true":
        pytest.fail(f"no Vulkan driver, or no viewer: {APT}")
    pytest.skip(f"no Vulkan driver, or no viewer; {APT}")


@pytest.fixture
def nothing_left() -> Iterator[None]:
    before = set(children()), set(Path("/dev/shm").iterdir())  # noqa: S108 - to see that nothing is left there
    yield
    assert set(children()) <= before[0]
    assert set(Path("/dev/shm").iterdir()) <= before[1]  # noqa: S108
