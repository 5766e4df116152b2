"""Cost of a whole run in the core against the same run in the loop of the host."""

from __future__ import annotations

import statistics
import sys
import time
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil import load_rig, simulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.config import Rig

_DURATION_S, _ROUND_COUNT = 30.0, 7
FACTOR_MIN = 1000.0
"""Times real time that a run of bench-1khz as shipped takes in the core, at least."""


class SimulateCosts(NamedTuple):
    """Device time over CPU time of whole runs, figures and columns kept, taken in turn."""

    loop: Sequence[float]
    core: Sequence[float]

    @property
    def ratios(self) -> Sequence[float]:
        """The core to the loop."""
        return [core / loop for core, loop in zip(self.core, self.loop, strict=True)]

    @property
    def goal(self) -> str:
        """Bar, and whether it was met."""
        met = statistics.median(self.core) >= FACTOR_MIN
        return f">= {FACTOR_MIN:g}: {'met' if met else 'not met'}"


def simulate_costs(rounds: int = _ROUND_COUNT) -> SimulateCosts:
    """Take both in turn; the library is compiled before."""
    rig = load_rig("bench-1khz")
    for plain in (True, False):
        _factor(rig, 0.1, plain=plain)
    pairs = [[_factor(rig, _DURATION_S, plain=plain) for plain in (True, False)] for _ in range(rounds)]
    return SimulateCosts([loop for loop, _ in pairs], [core for _, core in pairs])


def _factor(rig: Rig, seconds: float, *, plain: bool) -> float:
    began = time.process_time()
    result = simulate(rig, seconds, plain=plain)
    spent = time.process_time() - began
    assert plain or result.engine == "core", result.engine_reason  # noqa: S101 - else it measures the loop
    return seconds / spent


def main() -> None:
    """Measure, and print it."""
    found = simulate_costs()
    loop, core = (statistics.median(one) for one in found)
    sys.stdout.write(f"loop {loop:.0f} x, core {core:.0f} x real time ({found.goal})\n")


if __name__ == "__main__":
    main()
