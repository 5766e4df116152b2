"""Fixtures: a virtual device whose time passes when a test says so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.platform.clock import SimulatedClock
from sim_backend.board.virtual_device import VirtualDevice
from tests.helpers import bench

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def device() -> Iterator[VirtualDevice]:
    """Return a device whose time passes when the test says so, however long that takes."""
    with VirtualDevice(bench(), clock=SimulatedClock()) as made:
        yield made
