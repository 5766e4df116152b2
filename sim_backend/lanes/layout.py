"""Layout of the structures of firmware/boards/simlib/lanes.h as numpy types: the header is the one list."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

from sim_backend.compiling import build, header

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

HEADER = "boards/simlib/lanes.h"


class LanesLayout(NamedTuple):
    """Types of the structures and the constants of a library with so many lanes."""

    lanes: int
    structures: Mapping[str, np.dtype[np.void]]
    constants: Mapping[str, int]

    @property
    def common(self) -> np.dtype[np.void]:
        """Numbers that all lanes of a block have in common."""
        return self.structures["lanes_common"]

    @property
    def row(self) -> np.dtype[np.void]:
        """The reference at the instants of one tick."""
        return self.structures["lanes_row"]

    @property
    def block(self) -> np.dtype[np.void]:
        """Parameters and state of a block."""
        return self.structures["lanes_block"]


@functools.cache
def layout(lanes: int) -> LanesLayout:
    """Read the layout of a library with so many lanes.

    Raises
    ------
    OpenError
        If the C sources were not installed.
    """
    return read((build.sources() / HEADER).read_text(encoding="utf-8"), lanes)


def read(text: str, lanes: int) -> LanesLayout:
    """Read the layout from the text of the header."""
    return LanesLayout(lanes, *header.read(text, {"DCMP_LANES": lanes}))
