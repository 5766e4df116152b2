"""Works that a test sends to a cluster: one that runs a rig, and ones that end the worker."""

from __future__ import annotations

import os
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil import load_rig, run
from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import pause

if TYPE_CHECKING:
    from dcmp_hil.sweeping.executor import SweepBlock


@dataclass(frozen=True)
class ShortRuns:
    """Runs of the bench rig, each with its own seed; one block waits for its death the first time.

    Parameters
    ----------
    folder
        Where that block writes the number of its process.
    waiting
        Number of that block.
    """

    folder: str = ""
    waiting: int = -1

    def __call__(self, block: SweepBlock) -> list[tuple[float | None, ...]]:
        """Return what came out of each run of a block, exactly."""
        mark = Path(self.folder) / f"block-{block.number}"
        if block.number == self.waiting and not mark.exists():
            draft = mark.with_suffix(".draft")
            draft.write_text(str(os.getpid()))
            draft.rename(mark)
            pause(600.0)
        return [_figures(seed) for seed in range(block.first, block.first + block.runs)]


def _figures(seed: int) -> tuple[float | None, ...]:
    """Return the figures of a run of 0.2 s with this seed."""
    rig = load_rig(
        "bench-1khz", [f"sim.seed={seed}", "sim.encoder_noise_counts=0.3", "supervisor.start=immediate"]
    )
    found = run(rig, duration=0.2, fast=True).summary
    return found.tracking_rms_rad, found.velocity_error_rms_rad_s, found.voltage_tv_V_s, found.voltage_peak_V


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
