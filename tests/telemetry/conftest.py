"""Fixtures: no process and no shared memory stays behind."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.telemetry.sinks import children

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def nothing_left() -> Iterator[None]:
    before = set(children()), set(Path("/dev/shm").iterdir())  # noqa: S108 - to see that nothing is left there
    yield
    assert set(children()) <= before[0]
    assert set(Path("/dev/shm").iterdir()) <= before[1]  # noqa: S108
