"""A child process of the tests, which outlives its parent."""

from __future__ import annotations

import os
import select
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil.ipc.child_process import ParentProcess

_LOOK_PERIOD_S = 0.01


def main(parent: ParentProcess, pipe: int) -> None:
    """Write into a pipe that the parent is gone."""
    parent.channel.send(b"up")
    while parent.lives:
        select.select([], [], [], _LOOK_PERIOD_S)
    os.write(pipe, b"gone")
