"""One reproduction for the whole session: five runs of 20 s at 10 kHz are worth sharing."""

from __future__ import annotations

import pytest

from dcmp_hil.paper import Reproduction, reproduce
from tests.cli.conftest import cli

__all__ = ["cli"]


@pytest.fixture(scope="session")
def reproduction() -> Reproduction:
    return reproduce()
