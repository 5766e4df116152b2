"""Two ways out of a process: the run's own lines go to the terminal, those of libraries into a log.

A line that a library writes to descriptor 2 by itself, as Rerun does, would tear the status line. So where
the terminal is another descriptor, 2 is the log.
"""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

LOG_FILE_NAME = "process.log"
"""Its name in a run's folder."""
STDERR_FILENO = 2
"""The descriptor that libraries write to."""
_terminal: int | None = None


def use_terminal(descriptor: int) -> None:
    """Use `descriptor` for the run's own lines, in a process whose descriptor 2 is a log."""
    global _terminal  # noqa: PLW0603 - of this process, like sys.stderr
    _terminal = descriptor


def terminal() -> int | None:
    """Return the descriptor for the run's own lines, where `sys.stderr` is not the way to it."""
    return _terminal


def for_programs() -> int:
    """Return where a program that is started writes its log lines to, as `subprocess` takes it."""
    return (
        subprocess.DEVNULL if _terminal is None and descriptor_of_stderr() == STDERR_FILENO else STDERR_FILENO
    )


@contextmanager
def terminal_copy() -> Iterator[int]:
    """Yield a descriptor, other than 2, of what the run's own lines are written to."""
    try:
        descriptor = os.dup(descriptor_of_stderr())
    except OSError:  # closed when this process began
        descriptor = os.open(os.devnull, os.O_WRONLY)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def descriptor_of_stderr() -> int:
    """Return the descriptor that `sys.stderr` writes to; 2 where it has none, as in a notebook."""
    try:
        return STDERR_FILENO if sys.stderr is None else sys.stderr.fileno()
    except (OSError, ValueError):
        return STDERR_FILENO
