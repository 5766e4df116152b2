"""Layout of the structures of firmware/boards/simlib/lanes.h as numpy types: the header is the one list."""

from __future__ import annotations

import functools
import math
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sim_backend.compiling import build

if TYPE_CHECKING:
    from collections.abc import Mapping

HEADER = "boards/simlib/lanes.h"
_STRUCT = re.compile(r"struct (\w+) \{\n(.*?)\n\};", re.DOTALL)
_FIELD = re.compile(r"^    (?:struct )?(\w+) (\w+)(?:\[([\w *]+)\])?;", re.MULTILINE)
_CONSTANT = re.compile(r"^ *#?(?:define)? *(LANES_\w+)(?: =)? (\d+)", re.MULTILINE)
_NUMBERS: Mapping[str, type] = {"double": np.float64, "int64_t": np.int64}


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
    constants = {name: int(number) for name, number in _CONSTANT.findall(text)} | {"DCMP_LANES": lanes}
    structures: dict[str, np.dtype[np.void]] = {}
    for name, body in _STRUCT.findall(text):
        fields = []
        for kind, field, length in _FIELD.findall(body):
            number = _NUMBERS.get(kind)
            of: np.dtype[np.generic] = structures[kind] if number is None else np.dtype(number)
            shape = () if not length else (math.prod(constants[one] for one in length.split(" * ")),)
            fields.append((field, of, shape))
        structures[name] = np.dtype(fields)
    return LanesLayout(lanes, structures, constants)
