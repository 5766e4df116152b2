"""One nominal ride of the simulated rig, and every observer on its samples."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil import load_rig, run
from dcmp_hil.assembly import make_observer
from dcmp_hil.config.rig import KINDS
from dcmp_hil.values import Sample

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.control.observers import Observer

    Columns = dict[str, NDArray[np.float64]]

# The trajectory at once, from the paper's pose, with the zero of the encoder between two edges.
_OVERRIDES = ("supervisor.start=immediate", "sim.position_rad=-1.57", "sim.encoder_phase_counts=0.43")


def kinds() -> list[str]:
    """Return every kind of observer that comes with the package."""
    return [kind for kind in KINDS["observer"] if kind != "custom"]


def rig_with(kind: str) -> Rig:
    """Return the rig of the ride with an observer of that kind."""
    return load_rig("bench-1khz", [*_OVERRIDES, f"observer.kind={kind}"])


def ride(kind: str, seconds: float) -> Columns:
    """Return the columns of a ride of so many seconds, its loop closed by an observer of that kind."""
    return run(rig_with(kind), duration=seconds, fast=True).columns


def samples(columns: Columns) -> list[Sample]:
    """Return the samples that the loop of a ride was given."""
    names = ("time_s", "position_rad", "voltage_applied_V")
    return [Sample(*row) for row in zip(*(columns[name].tolist() for name in names), strict=True)]


def fresh(kind: str) -> Observer:
    """Make an observer of that kind."""
    return make_observer(rig_with(kind))
