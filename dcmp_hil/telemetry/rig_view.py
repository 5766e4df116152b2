"""What a viewer is told about a rig."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dcmp_hil.config.explain import explain, simulated

if TYPE_CHECKING:
    from dcmp_hil.config import Rig


@dataclass(frozen=True, slots=True)
class RigView:
    """What a viewer is told about a rig.

    Parameters
    ----------
    name
        What the recording is called.
    parameters
        Rows of the table of parameters: name and value, units included.
    voltage_limit
        V; None where there is none.
    simulated
        The rig is a simulation, so what is shown as moving is the truth.
    period
        s, nominal.
    """

    name: str
    parameters: tuple[tuple[str, str], ...]
    voltage_limit: float | None
    simulated: bool
    period: float


_FIRST = ("controller", "observer", "reference", "loop")  # what is tuned stands where nobody need scroll


def view_of(rig: Rig) -> RigView:
    """Reduce a rig to what a viewer shows."""
    limit = rig.amplifier.limit
    rows = [(key, value.strip('"')) for key, value, _ in explain(rig) if key != "name"]
    return RigView(
        name=rig.name,
        parameters=tuple(sorted(rows, key=_place)),
        voltage_limit=limit if math.isfinite(limit) else None,
        simulated=simulated(rig),
        period=rig.period,
    )


def _place(row: tuple[str, str]) -> int:
    table = row[0].partition(".")[0]
    return _FIRST.index(table) if table in _FIRST else len(_FIRST)
