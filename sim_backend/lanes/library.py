"""The compiled lanes (firmware/boards/simlib/lanes.c) as ctypes sees them."""

from __future__ import annotations

import ctypes
import functools
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import OpenError
from sim_backend.compiling.build import SHARED, Target, compiled
from sim_backend.lanes.instruction_sets import here
from sim_backend.lanes.layout import LanesLayout, layout

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from sim_backend.lanes.instruction_sets import InstructionSet

LANES = 32
"""Lanes of a block: with AVX-512 four vectors of each number, so that one does not wait for another."""
_OPTIMISATION = ("-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
_FILES = ("core/*.h", "boards/simlib/lanes*.[ch]")


class Lanes(NamedTuple):
    """A library of so many lanes.

    Parameters
    ----------
    run
        `dcmp_lanes_run`; releases the interpreter's lock.
    layout
        Of its structures.
    """

    run: Callable[..., int]
    layout: LanesLayout


@functools.cache
def load(lanes: int = LANES, instruction_set: InstructionSet | None = None) -> Lanes:
    """Compile the library if need be, and load it.

    Parameters
    ----------
    lanes
        Runs side by side.
    instruction_set
        None takes the widest vectors that this computer has.

    Raises
    ------
    OpenError
        If it cannot be compiled or loaded.
    """
    flags = flags_for(instruction_set or here()[0], lanes)
    return load_file(compiled(Target("a sweep in lanes", "liblanes.so", _FILES, flags)), lanes)


def load_single() -> Lanes:
    """Compile the library of one lane if need be, and load it.

    Raises
    ------
    OpenError
        If it cannot be compiled or loaded.
    """
    return load(1)


def flags_for(instruction_set: InstructionSet, lanes: int) -> tuple[str, ...]:
    """Return the compiler's flags for a library of so many lanes."""
    return (*SHARED, *_OPTIMISATION, *instruction_set.flags, f"-DDCMP_LANES={lanes}")


def load_file(path: Path, lanes: int) -> Lanes:
    """Load a library that was compiled for so many lanes.

    Raises
    ------
    OpenError
        If it cannot be loaded.
    """
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise OpenError(
            f"{path}: cannot be loaded ({error}). Delete {path.parent} to have it made again, or point "
            "XDG_CACHE_HOME at a folder that programs may be started from."
        ) from error
    found = layout(lanes)
    library.dcmp_lanes_block_bytes.restype = ctypes.c_int64
    if library.dcmp_lanes_block_bytes() != found.block.itemsize:
        raise AssertionError(f"{path}: struct lanes_block is not what {__name__} read from its header")
    run: Callable[..., int] = library.dcmp_lanes_run
    library.dcmp_lanes_run.restype = ctypes.c_int64
    pointer, number = ctypes.c_void_p, ctypes.c_int64
    library.dcmp_lanes_run.argtypes = (pointer, pointer, pointer, number, number, pointer, pointer)
    return Lanes(run, found)


def address(array: NDArray[np.void] | NDArray[np.float64] | None) -> int | None:
    """Return where an array begins, for C; None for none."""
    return None if array is None else int(array.ctypes.data)
