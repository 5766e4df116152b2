"""The changes that were made while a run went on, found again in its events."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Literal, NamedTuple

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.tunables import changed, settable
from dcmp_hil.values import ChangeData

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.control.change import Change
    from dcmp_hil.values import Event

Values = dict[str, float | str]


class UnrepeatedChange(NamedTuple):
    """A recorded change, or a part of it, that a repetition does not make.

    Parameters
    ----------
    t
        Device time of the period after which it was made, s.
    values
        By dotted key, what was set in the run.
    why
        `pinned`: the repetition names these keys itself; `refused`: its rig does not take them.
    reason
        Why they were refused, as a sentence; empty for pinned ones.
    """

    t: float
    values: Mapping[str, float | str]
    why: Literal["pinned", "refused"]
    reason: str = ""


class RecordedChanges(NamedTuple):
    """The changes of a run, as one repetition makes them.

    Parameters
    ----------
    made
        Device time of the period after which it is made, s, and the change, in order.
    unrepeated
        What is not made, in order.
    """

    made: tuple[tuple[float, Change], ...]
    unrepeated: tuple[UnrepeatedChange, ...]


def changes_in(events: Sequence[Event], rig: Rig, pinned: Collection[str] = ()) -> RecordedChanges:
    """Find the changes of a run, and those of them that a repetition with this rig can make.

    A key of `pinned` that this rig has stays what `rig` says. Of the rest, keys that cannot change in a run
    with this rig are left out; then all that remains of one change is made, or nothing of it.

    Parameters
    ----------
    events
        Of the run.
    rig
        As the repetition begins.
    pinned
        Dotted keys that the repetition names itself.
    """
    made: list[tuple[float, Change]] = []
    unrepeated: list[UnrepeatedChange] = []
    for event in events:
        if not (isinstance(event.data, ChangeData) and event.data.values):
            continue
        named, rest = _parted(event.data.values, pinned)
        held, lacking = _parted(named, settable(rig))  # what the rig has not is not left out for its name
        if held:
            unrepeated.append(UnrepeatedChange(event.t, held, "pinned"))
        unknown, rest = _parted(rest, _unknown(rig, rest))
        refused = lacking | unknown
        if refused:
            unrepeated.append(UnrepeatedChange(event.t, refused, "refused", _not_settable(rig, refused)))
        if not rest:
            continue
        # JSON's numbers and texts are TOML's, and come back to the bit.
        overrides = [f"{key}={json.dumps(value)}" for key, value in rest.items()]
        try:
            rig, change = changed(rig, overrides, repeated=True)
        except ConfigError as error:
            reason = error.faults[0].removeprefix("--set ")
            unrepeated.append(UnrepeatedChange(event.t, rest, "refused", reason))
        else:
            made.append((event.t, change))
    return RecordedChanges(tuple(made), tuple(unrepeated))


def _parted(values: Mapping[str, float | str], keys: Collection[str]) -> tuple[Values, Values]:
    """Return the values of these keys, and those of all others."""
    return (
        {key: value for key, value in values.items() if key in keys},
        {key: value for key, value in values.items() if key not in keys},
    )


def _unknown(rig: Rig, values: Mapping[str, float | str]) -> list[str]:
    """Return the keys that this rig does not let change; with another kind, a table has other keys."""
    known = settable(rig)
    kinds = {key.partition(".")[0] for key in values if key.endswith(".kind") and key in known}
    return [key for key in values if key not in known and key.partition(".")[0] not in kinds]


def _not_settable(rig: Rig, values: Mapping[str, float | str]) -> str:
    """Return why a rig does not take these keys, as a sentence."""
    kinds = {"observer": rig.observer.kind, "controller": rig.controller.kind}
    tables = dict.fromkeys(key.partition(".")[0] for key in values)
    owners = [f'{table}.kind = "{kinds[table]}"' for table in tables if table in kinds]
    return f"{' and '.join(owners) or 'this rig'} does not let it change in a run."
