"""Specs of small sweeps, and figures of runs that were made one by one."""

from __future__ import annotations

import json
import math
import shlex
from typing import TYPE_CHECKING, Any

from dcmp_hil.sweeping.engine import FIGURES
from dcmp_hil.sweeping.spec_file import spec_from

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.sweeping.spec import SweepSpec

SMALL: dict[str, Any] = {
    "rig": "bench-1khz",
    "duration_s": 0.3,
    "runs": 3,
    "set": {"supervisor": {"start": "immediate"}},
    "grid": {"loop.delay_samples": [0, 1]},
    "draw": {"sim.plant.f1_rad_s2": {"normal": [1.3, 0.1]}},
}
"""Two points of a grid with three draws each."""


def spec(**changes: Any) -> SweepSpec:
    """Return the small spec with changes."""
    return spec_from({**SMALL, **changes}, "spec")


def written(folder: Path, text: str) -> Path:
    """Return the path of a sweep's file with a text."""
    place = folder / "spec.toml"
    place.write_text(text, "utf-8")
    return place


def by_command(cli: Callable[..., Any], command: str) -> dict[str, Any]:
    """Return the figures of a printed command, called as it stands."""
    program, *words = shlex.split(command)
    assert program == "dcmp-hil"
    outcome = cli(*words, "--viewer", "none", "--no-record", "--json", "-")
    document = json.loads(outcome.out)
    return {name: math.nan if document[name] is None else document[name] for name in FIGURES}


def row(table: Any, number: int) -> dict[str, Any]:
    """Return the figures of a run of a table."""
    return {name: table.column(name)[number].as_py() for name in FIGURES}
