"""The parts of a rig that a viewer shows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TYPE_CHECKING

from dcmp_hil.config.explain import explain, numbers
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.sections import Custom
from dcmp_hil.control.model import UNKNOWN_MODEL
from dcmp_hil.platform.host_info import host_facts
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.config import Rig
    from dcmp_hil.control.model import Model


@dataclass(frozen=True, slots=True)
class RigView:
    """The parts of a rig that a viewer shows.

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
    model
        What the host believes of the plant.
    wired
        Whether there is a wire, with counters.
    about
        Rows of the table of versions and of the computer.
    kinds
        "reference.kind=sine" to the keys of that kind, for what may change in a run.
    numbers
        Of the parameters, those that are numbers.
    further
        Names of the further columns of its cycles, as far as they are known before the run.
    """

    name: str
    parameters: tuple[tuple[str, str], ...]
    voltage_limit: float | None
    simulated: bool
    period: float
    model: Model = UNKNOWN_MODEL
    wired: bool = False
    about: tuple[tuple[str, str], ...] = ()
    kinds: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    further: tuple[str, ...] = ()


_FIRST_KEYS = ("controller", "observer", "reference", "loop")  # what is tuned is visible without scrolling


def view_of(rig: Rig, further: tuple[str, ...] | None = None) -> RigView:
    """Return the parts of a rig that a viewer shows.

    Parameters
    ----------
    rig
        The rig.
    further
        Names of the further columns of its cycles; None takes those that its built-in observer has.
    """
    if further is None:
        further = () if isinstance(rig.observer, Custom) else rig.observer.diagnosis()
    limit = rig.amplifier.limit
    rows = [(key, value.strip('"')) for key, value, _ in explain(rig) if key != "name"]
    return RigView(
        name=rig.name,
        parameters=tuple(sorted(rows, key=_place)),
        voltage_limit=limit if math.isfinite(limit) else None,
        simulated=rig.backend.simulated,
        period=rig.period,
        model=rig.model.values(),
        wired=rig.backend.device or not rig.backend.simulated,
        about=_about(),
        kinds=_kinds(),
        numbers=numbers(rig),
        further=further,
    )


def _kinds() -> dict[str, tuple[str, ...]]:
    """Return the keys of every kind of controller, observer and reference."""
    return {
        f"{section}.kind={kind}": tuple(f"{section}.{key}" for key in settings.model_fields)
        for section in ("controller", "observer", "reference")
        for kind, settings in KINDS[section].items()
    }


def _about() -> tuple[tuple[str, str], ...]:
    """Return versions, and what is known of the computer."""
    packages = [(name, version(name)) for name in ("dcmp-hil", "rerun-sdk", "numpy")]
    facts = host_facts()
    privileges = facts.pop("privileges")
    rows = {**facts, **privileges}
    return (
        *packages,
        ("protocol", f"{PROTOCOL_HASH:08x}"),
        *((name, "unknown" if fact is None else str(fact)) for name, fact in rows.items()),
    )


def _place(row: tuple[str, str]) -> int:
    table = row[0].partition(".")[0]
    return _FIRST_KEYS.index(table) if table in _FIRST_KEYS else len(_FIRST_KEYS)
