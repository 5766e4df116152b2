"""The virtual device's library and program."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim_backend.compiling.build import SHARED, Target, compiled

if TYPE_CHECKING:
    from pathlib import Path

_WHAT = "the virtual device"
_LIBRARY = Target(_WHAT, "libdcmp.so", ("core/*.[ch]", "boards/hostlib/*.[ch]"), SHARED)
_PROGRAM = Target(_WHAT, "dcmp-native", ("core/*.[ch]", "boards/native/*.[ch]"), ("-D_XOPEN_SOURCE=700",))


def library() -> Path:
    """Return the core as a shared library (boards/hostlib); compile it if it is not there yet.

    Raises
    ------
    OpenError
        If there is no compiler, it fails, or the cache cannot be written.
    """
    return compiled(_LIBRARY)


def program() -> Path:
    """Return the native board as a program (boards/native); compile it if it is not there yet.

    Raises
    ------
    OpenError
        If there is no compiler, it fails, or the cache cannot be written.
    """
    return compiled(_PROGRAM)
