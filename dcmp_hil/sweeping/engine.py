"""Engines of a sweep: what a run of one is, and where the engines are found by name."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.config import Rig

LANES = "lanes"
PLAIN = "plain"
ENGINES = {
    LANES: "sim_backend.lanes.engine:LaneEngine",
    PLAIN: "dcmp_hil.sweeping.plain_loop:PlainLoop",
}
"""`module:Class` of each engine, made as Class(); the first that refuses a rig not is the one that runs it.

Every process of a sweep makes its own. Making one is cheap and raises nothing: what an engine lacks, such as
a compiler, is a refusal.
"""


class RunOutcome(NamedTuple):
    """The figures of one run, as `dcmp_hil.run(rig, duration=..., fast=True)` gives them, to the bit.

    A run that the supervisor ended has the figures of what ran until then. NaN: not known.
    """

    periods: int
    """Number of cycles."""
    tracking_rms_rad: float = math.nan
    """True position minus the reference at the same instant, root mean square, rad."""
    tracking_max_rad: float = math.nan
    """The same, largest, rad."""
    velocity_error_rms_rad_s: float = math.nan
    """Estimated minus true velocity, root mean square, rad/s."""
    velocity_error_max_rad_s: float = math.nan
    """The same, largest, rad/s."""
    disturbance_error_rms_rad_s2: float = math.nan
    """Estimated minus true disturbance, root mean square, rad/s2."""
    voltage_peak_V: float = math.nan
    """Largest voltage sent, V."""
    voltage_tv_V_s: float = math.nan
    """Total variation of the voltage sent, V/s."""
    tripped: bool = False
    """Whether the supervisor ended the run."""
    trip_time_s: float = math.nan
    """Device time of the cycle in which it did, s."""
    trip_cause: str = ""
    """`TripError.reason`, such as "speed"."""


FIGURES = RunOutcome._fields[: RunOutcome._fields.index("tripped")]
"""Names of the figures of a run, which are those of `dcmp_hil.Summary`."""


class SweepEngine(Protocol):
    """Runs rigs in virtual time; an instance is used by one thread at a time."""

    def refusal(self, rig: Rig) -> str:
        """Return why this engine cannot run a rig, in a sentence with the remedy if there is one.

        Empty: it takes the rig. The answer depends on kinds and settings, and costs microseconds.
        """
        ...

    def run(self, rigs: Sequence[Rig], duration_s: float) -> list[RunOutcome]:
        """Run rigs, none of which is refused, for `duration_s` (s) of device time each.

        The outcome of a rig does not depend on the others in the list.
        """
        ...
