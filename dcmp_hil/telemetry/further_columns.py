"""Further columns of a run: numbers of each cycle that not every run has, such as what an observer found."""

from __future__ import annotations

import re
from itertools import chain
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.signals import names as signal_names

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from dcmp_hil.values import Cycle, Event

FURTHER_MAX = 64
"""Further columns that a run may have."""
_NAME_CHARS_MAX = 80
_NAME = re.compile(r"[a-z](?:_?[a-z0-9])*(?:_V)?")
_UNITS = {
    "t": "s", "began": "s", "period": "s", "lateness": "s", "compute": "s", "fault": "",
    "position": "rad", "velocity": "rad_s", "acceleration": "rad_s2", "disturbance": "rad_s2", "voltage": "v",
}  # fmt: skip


def _with_unit(field: str) -> str:
    """Return a field's name as a ROS message may have it: lower case, and its unit at the end."""
    unit = _UNITS[field.partition("_")[0]]
    return f"{field}_{unit}" if unit else field


CHANNEL_NAMES = tuple(_with_unit(field) for field in FIELDS)
"""Names of the fields of every row, lower case, each with its unit."""
_OTHER_NAMES = {name.lower() for name in (*FIELDS, *CHANNEL_NAMES, *signal_names())}


class FurtherColumns(Protocol):
    """Protocol of a source of further columns; the recorder asks it when the command has left."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names with their units, which `fault_of` must accept; they stay the same for the whole run."""
        ...

    def values(self, cycle: Cycle, /) -> tuple[float, ...]:
        """Return one number for each name, of the cycle that has just ended; must not raise."""
        ...

    def events(self) -> Sequence[Event]:
        """Return what happened since the last call; asked for about once a second and at the end."""
        ...


class _NoColumns:
    names: tuple[str, ...] = ()

    def values(self, _: Cycle) -> tuple[float, ...]:
        return ()

    def events(self) -> Sequence[Event]:
        return ()


NO_FURTHER_COLUMNS: FurtherColumns = _NoColumns()


class JoinedColumns:
    """The further columns of several sources, in their order.

    Parameters
    ----------
    sources
        At least one.
    """

    def __init__(self, sources: Sequence[FurtherColumns]) -> None:
        self._sources = tuple(sources)
        self.names = tuple(chain.from_iterable(source.names for source in self._sources))

    def values(self, cycle: Cycle) -> tuple[float, ...]:
        """Return the numbers of all sources."""
        return tuple(chain.from_iterable([source.values(cycle) for source in self._sources]))

    def events(self) -> Sequence[Event]:
        """Return what happened since the last call, of all sources."""
        return [event for source in self._sources for event in source.events()]


def joined(sources: Iterable[FurtherColumns]) -> FurtherColumns:
    """Return the further columns of all sources as one; those without any cost nothing."""
    some = [source for source in sources if source.names]
    if not some:
        return NO_FURTHER_COLUMNS
    return some[0] if len(some) == 1 else JoinedColumns(some)


def fault_of(names: Sequence[str]) -> str:
    """Return what is wrong with the names of further columns, as the end of a sentence; empty if nothing is.

    A name is a ROS field's, lower case, with its unit at the end: `friction_found_rad_s2`. Volts are `_V`.
    """
    if len(names) > FURTHER_MAX:
        return f"there are {len(names)}, and {FURTHER_MAX} are the most"
    known = set(_OTHER_NAMES)
    for name in names:
        if len(name) > _NAME_CHARS_MAX or name.endswith("_v") or not _NAME.fullmatch(name):
            return (
                f"{name[:_NAME_CHARS_MAX]!r} is no name: use a-z, 0-9 and single _, {_NAME_CHARS_MAX} "
                "characters at most, with the unit at the end, volts as _V"
            )
        if name.lower() in known:
            return f"{name} is there already"
        known.add(name.lower())
    return ""


def begin(sink: object, names: tuple[str, ...]) -> None:
    """Tell a sink the names of the further columns before any block or event, if it has a method `begin`."""
    told = getattr(sink, "begin", None)
    if told is not None:
        told(names)
