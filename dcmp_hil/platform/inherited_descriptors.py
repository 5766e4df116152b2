"""Descriptors that a forked process must not hold: ports and lines, which would outlive this process.

A class of the user's own may fork (`multiprocessing` does so on Linux). The copy has every descriptor: the
lock of the serial port, the line whose end tells other processes that this one has gone.
"""

from __future__ import annotations

import os
from contextlib import suppress

_ours: set[int] = set()


def keep_from_forks(descriptor: int) -> int:
    """Redirect `descriptor` to /dev/null in every process that is forked from now on; return it."""
    _ours.add(descriptor)
    return descriptor


def forget(descriptor: int) -> None:
    """Leave `descriptor` alone from now on: it is about to be closed, and its number is used again."""
    _ours.discard(descriptor)


def _let_go() -> None:
    """Replace what is ours, in a process that was just forked: closed numbers would be used again."""
    if not _ours:
        return
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_RDWR)
        for descriptor in _ours:
            with suppress(OSError):
                os.dup2(nowhere, descriptor, inheritable=False)
        os.close(nowhere)
    _ours.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)
