"""The firmware's shared library (firmware/boards/hostlib) as ctypes sees it."""

from __future__ import annotations

import ctypes
import functools

from dcmp_hil.errors import OpenError
from sim_backend.board import build
from sim_backend.board.config import LAYOUT

CARRIERS = {"cobs": 0, "slcan": 1, "can": 2}
"""By name; `can` gives records instead of bytes: identifier, length, 8 bytes of data."""
RECORD = "<HB8s"

VOLTAGE, ENABLE, STATE, FAULT, OWNER, LINK_UP, OUT_LENGTH, OUT_OFFSET = range(8)
"""Indices of `struct hostlib_view`."""

_RARE_CALLS = (
    ("init", ctypes.c_bool, (ctypes.c_char_p, ctypes.c_int32, ctypes.c_uint32, ctypes.c_uint32)),
    ("look", None, (ctypes.c_uint32,)),
    ("link", None, (ctypes.c_bool, ctypes.c_uint32)),
    ("size", ctypes.c_size_t, None),
    ("config_size", ctypes.c_size_t, None),
)
_FREQUENT_CALLS = ("tick", "receive", "receive_frame")
"""They take a pointer, bytes, and integers of 32 bits, which is what ctypes makes of an int by itself:
without declared types a call takes half the time."""


@functools.cache
def load() -> ctypes.PyDLL:
    """Compile the library if need be, and load it.

    Its functions take about a microsecond and never wait: the interpreter's lock is kept over a call, which
    also makes each of them one step for other threads.

    Raises
    ------
    OpenError
        If it cannot be compiled or loaded.
    """
    path = build.library()
    try:
        library = ctypes.PyDLL(str(path))
    except OSError as error:
        raise OpenError(
            f"{path}: cannot be loaded ({error}). Delete {path.parent} to have it made again, or point "
            "XDG_CACHE_HOME at a folder that programs may be started from."
        ) from error
    for name, result, arguments in _RARE_CALLS:
        function = getattr(library, f"hostlib_{name}")
        function.restype = result
        function.argtypes = () if arguments is None else (ctypes.c_void_p, *arguments)
    for name in _FREQUENT_CALLS:
        getattr(library, f"hostlib_{name}").restype = None
    if library.hostlib_config_size() != LAYOUT.size:
        raise AssertionError(f"{path}: struct dcmp_config is not what sim_backend.board.config says")
    return library
