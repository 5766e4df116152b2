"""The compiled run (firmware/boards/simlib/run.c) as ctypes sees it."""

from __future__ import annotations

import ctypes
import functools
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import OpenError
from sim_backend.compiling import build, header
from sim_backend.compiling.build import SHARED, Target, compiled

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np

TARGET = Target(
    "a run in the core",
    "librun.so",
    ("core/*.h", "boards/simlib/simlib.h", "boards/simlib/run*.[ch]"),
    (*SHARED, "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
)
_RETURNS = ("ROWS_FULL", "LOG_FULL", "BEGINS", "ASKS", "REFERENCES_USED", "REACHED", "OVER")
_HEADER, _CAUSES = "boards/simlib/run.h", "core/dcmp_cause.h"


class RunLibrary(NamedTuple):
    """Functions of run.h, and what its header and that of the causes say."""

    state_bytes: int
    begin: Callable[..., None]
    cycles: Callable[..., int]
    structures: Mapping[str, np.dtype[np.void]]
    constants: Mapping[str, int]
    causes: Mapping[int, str]
    """Names of the causes without DCMP_CAUSE_, by number."""
    returns: Mapping[int, str]
    """Names of the reasons for which `cycles` returns, without RUN_, by number."""


@functools.cache
def load() -> RunLibrary:
    """Compile the library if need be, and load it.

    Raises
    ------
    OpenError
        If it cannot be compiled or loaded.
    """
    path = compiled(TARGET)
    try:
        library = ctypes.CDLL(str(path))  # releases the interpreter's lock over a call
    except OSError as error:
        raise OpenError(
            f"{path}: cannot be loaded ({error}). Delete {path.parent} to have it made again, or point "
            "XDG_CACHE_HOME at a folder that programs may be started from."
        ) from error
    found = header.read(_text(_HEADER))
    pointer, number = ctypes.c_void_p, ctypes.c_int64
    library.run_state_bytes.restype = library.run_cycles.restype = number
    library.run_begin.restype = None
    library.run_begin.argtypes = (pointer, pointer)
    library.run_cycles.argtypes = (
        pointer, pointer, pointer, number, pointer, number, pointer, number,
    )  # fmt: skip
    causes = header.constants_of(_text(_CAUSES))
    return RunLibrary(
        library.run_state_bytes(),
        library.run_begin,
        library.run_cycles,
        found.structures,
        found.constants,
        {value: name.removeprefix("DCMP_CAUSE_") for name, value in causes.items()},
        {found.constants[f"RUN_{name}"]: name for name in _RETURNS},
    )


def _text(file: str) -> str:
    return (build.sources() / file).read_text(encoding="utf-8")
