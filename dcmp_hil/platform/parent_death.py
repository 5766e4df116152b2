"""A program that ends with the process that started it, however that ended."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from dcmp_hil.platform.python_command import python_command

if TYPE_CHECKING:
    from collections.abc import Sequence

# PR_SET_PDEATHSIG (prctl(2)) is kept across exec. A parent that died before the call is noticed behind it.
_CODE = """
import ctypes, os, sys
parent, *command = sys.argv[1:]
ctypes.CDLL(None).prctl(1, 9)
if os.getppid() == int(parent):
    os.execv(command[0], command)
"""


def tied(command: Sequence[str]) -> list[str]:
    """Return a command that runs `command` until this process ends, then kills it.

    It is to be started from the main thread: what Linux watches is the thread that starts a process. Where
    there is no prctl, as on macOS, the command is returned as it is.
    """
    if not sys.platform.startswith("linux"):
        return list(command)
    return python_command(_CODE, str(os.getpid()), *command, isolated=True)
