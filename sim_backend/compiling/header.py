"""Structures and constants of a C header as numpy types and numbers: the header is the one list of them."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

_STRUCT = re.compile(r"struct (\w+) \{\n(.*?)\n\};", re.DOTALL)
_FIELD = re.compile(r"^    (?:struct )?(\w+) (\w+)(?:\[([\w *]+)\])?;", re.MULTILINE)
_CONSTANT = re.compile(r"(?:#define +([A-Z]\w*) +|\b([A-Z]\w*) = )(\d+)")
_NUMBERS: Mapping[str, type] = {"double": np.float64, "int64_t": np.int64}


class Header(NamedTuple):
    """Content of a header whose fields have 8 bytes each.

    Parameters
    ----------
    structures
        Types of the structures, by name.
    constants
        Numbers of `#define` and `enum`, by name.
    """

    structures: Mapping[str, np.dtype[np.void]]
    constants: Mapping[str, int]


def read(text: str, defined: Mapping[str, int] | None = None) -> Header:
    """Read the text of a header.

    Parameters
    ----------
    text
        In the project's own format.
    defined
        Constants that the compiler's flags define.
    """
    constants = {**constants_of(text), **(defined or {})}
    structures: dict[str, np.dtype[np.void]] = {}
    for name, body in _STRUCT.findall(text):
        fields = []
        for kind, field, length in _FIELD.findall(body):
            number = _NUMBERS.get(kind)
            of: np.dtype[np.generic] = structures[kind] if number is None else np.dtype(number)
            shape = () if not length else (math.prod(constants[one] for one in length.split(" * ")),)
            fields.append((field, of, shape))
        structures[name] = np.dtype(fields)
    return Header(structures, constants)


def constants_of(text: str) -> dict[str, int]:
    """Read the constants of a header alone, whose structures may have fields of any kind."""
    return {first or second: int(number) for first, second, number in _CONSTANT.findall(text)}
