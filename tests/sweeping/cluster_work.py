"""Works that a test sends to a cluster: one that waits to be killed, and ones that end the worker."""

from __future__ import annotations

import os
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import pause

if TYPE_CHECKING:
    from dcmp_hil.sweeping.block_work import BlockWork, RunRow
    from dcmp_hil.sweeping.executor import SweepBlock


@dataclass(frozen=True)
class HeldWork:
    """The work of a sweep, in which one block waits for its death the first time.

    Parameters
    ----------
    work
        Of the sweep.
    folder
        Where that block writes the number of its process.
    waiting
        Number of that block.
    """

    work: BlockWork
    folder: str
    waiting: int

    def __call__(self, block: SweepBlock) -> list[RunRow]:
        """Return the rows of a block."""
        mark = Path(self.folder) / f"block-{block.number}"
        if block.number == self.waiting and not mark.exists():
            draft = mark.with_suffix(".draft")
            draft.write_text(str(os.getpid()))
            draft.rename(mark)
            pause(600.0)
        return self.work(block)


def die(block: SweepBlock) -> None:
    """End the worker under any block."""
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError(block)


def refuse(block: SweepBlock) -> None:
    """Refuse a block, as a rig that is wrong does."""
    raise ConfigError(f"block {block.number}: wrong", "in two ways")


def fail(block: SweepBlock) -> None:
    """Fail as code does that has a fault."""
    raise ZeroDivisionError(block.number)
