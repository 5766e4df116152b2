"""Rigs of several groups, trips among them; run as a program, it prints their outcomes by one library."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from sim_backend.lanes.engine import LaneEngine
from sim_backend.lanes.library import load_file
from tests.sim_backend.lanes import crafted
from tests.sim_backend.lanes.runs import CASES, REPEATED, TRIPS, drawn

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

MIXED_S = 0.4


def mixed() -> list[Rig]:
    """Return rigs of several groups, with more than one block of one, and with trips."""
    overrides = [*CASES.values(), *(chosen for chosen, _ in TRIPS.values()), *REPEATED.values()]
    return [*drawn(9, ()), *(rig for k, chosen in enumerate(overrides) for rig in drawn(2, chosen, k))]


def main(path: str, lanes: str, seconds: str) -> None:
    """Print the outcomes of the mixed rigs by the library at a path."""
    library = load_file(Path(path), int(lanes))
    for craft in (crafted.causes, crafted.jumps, crafted.chatter, crafted.bursts, crafted.ramps):
        craft(library)
    engine = LaneEngine(library=lambda: library)
    for outcome in engine.run(mixed(), float(seconds)):
        print(repr(outcome))  # noqa: T201 - read by the test that started this


if __name__ == "__main__":
    main(*sys.argv[1:])
