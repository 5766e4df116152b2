"""Fixtures: a name for a module that no other test has."""

from __future__ import annotations

import itertools
import sys
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

_numbers = itertools.count()


@pytest.fixture
def module() -> Iterator[str]:
    """Give a name for a module that no other test has, forgotten at the end."""
    name = f"plug_in_{next(_numbers)}"
    yield name
    for known in [known for known in sys.modules if known.partition(".")[0] == name]:
        del sys.modules[known]
