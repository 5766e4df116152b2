"""The simulated rig's shared library (firmware/boards/simlib) as ctypes sees it."""

from __future__ import annotations

import ctypes
import functools

from dcmp_hil.errors import OpenError
from sim_backend.compiling.build import SHARED, Target, compiled

TARGET = Target(
    "the simulated plant",
    "libsim.so",
    (
        "core/dcmp_real.h",
        "core/dcmp_elementary.h",
        "core/dcmp_random.h",
        "core/dcmp_plant.h",
        "boards/simlib/simlib.h",
        "boards/simlib/simlib.c",
    ),
    (*SHARED, "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
)
"""Without -ffp-contract=off the last bits would depend on compiler and processor."""


_INTEGERS = frozenset(("tick", "samples", "seed", "steps", "periods", "reads"))
_NAMES = (
    *("tick", "samples", "voltage", "shown", "seed", "lost"),
    *("f0", "f1", "gravity", "ku", "eta", "eta_amplitude", "eta_rate", "believed_f0", "believed_ku"),
    *("step", "steps", "periods", "position", "velocity", "before", "disturbance"),
    *("count", "phase", "noise", "reads"),
    *("limit", "slew", "dead_zone", "quantum", "delay"),
    *("waiting_1", "waiting_2", "waiting_3", "ramp", "output", "newest"),
)
"""Fields of `struct simlib`, each of 8 bytes, in their order."""
FIELDS = {name: place for place, name in enumerate(_NAMES)}
"""Places of the fields."""


class Simulation:
    """Memory of one simulated rig.

    Parameters
    ----------
    values
        Of fields; the others are 0.
    """

    def __init__(self, **values: float) -> None:
        memory = (ctypes.c_double * len(_NAMES))()
        self.pointer = ctypes.c_void_p(ctypes.addressof(memory))
        whole = memoryview(memory).cast("B")
        self.numbers, self.integers = whole.cast("d"), whole.cast("q")
        for name, value in values.items():
            if name in _INTEGERS:
                self.integers[FIELDS[name]] = int(value)
            else:
                self.numbers[FIELDS[name]] = value


@functools.cache
def load() -> ctypes.PyDLL:
    """Compile the library if need be, and load it.

    Its functions take a pointer, and no longer than the plant's steps of a period: the interpreter's lock is
    kept over a call. Without declared types a call takes half the time.

    Raises
    ------
    OpenError
        If it cannot be compiled or loaded.
    """
    path = compiled(TARGET)
    try:
        library = ctypes.PyDLL(str(path))
    except OSError as error:
        raise OpenError(
            f"{path}: cannot be loaded ({error}). Delete {path.parent} to have it made again, or point "
            "XDG_CACHE_HOME at a folder that programs may be started from."
        ) from error
    library.simlib_size.restype = ctypes.c_size_t
    for name in ("plant", "advance", "read", "sample"):
        getattr(library, f"simlib_{name}").restype = None
    if library.simlib_size() != 8 * len(_NAMES):
        raise AssertionError(f"{path}: struct simlib is not what sim_backend.core_library says")
    return library
