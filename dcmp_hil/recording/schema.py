"""Format of a recording: topics, schemas, and the bytes of a cycle, which ROS tools read as well."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from dcmp_hil.common.printable_text import readable
from dcmp_hil.control import elementary
from dcmp_hil.telemetry.further_columns import CHANNEL_NAMES, FURTHER_MAX, fault_of
from dcmp_hil.values import DATA, OPTIONAL_DATA, Event, EventKind, Level

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

PROFILE, LIBRARY = "ros2", "dcmp-hil"
FORMAT, FORMAT_1 = "2", "1"
"""Of what is said about a run; a number that this version does not know is refused. In format 1 an event had
no kind, no data (see `recording.format_1`) and no number, and what is said of a run was under no checksum."""
NUMERICS, NUMERICS_1 = str(elementary.NUMERICS), "1"
"""Of the functions that observer and predictor are made of: a recording replays to the bit by its own.
Where none is said it is 1 (see `control.numerics_1`); one that is not known here is refused."""
CYCLES, EVENTS = "/cycles", "/events"
RUN, ABOUT, RIG, END, FURTHER = "run", "run.json", "rig.json", "end.json", "further_columns.json"
"""Names of the metadata that say what the run was; of the attachments that say it under a checksum, of the
rig, of what is known at the end, and of the names of the further columns, if it has any."""

_HEADER = b"\0\1\0\0"  # of CDR: little endian
_LEVELS: dict[Level, int] = {"DEBUG": 1, "INFO": 2, "WARN": 3, "ERROR": 4}  # of foxglove.Log
_FROM_LEVELS = {number: level for level, number in _LEVELS.items()}
_TEXT_CHARS_MAX = 10_000  # characters
_ADAPTERS = {kind: TypeAdapter(data) for kind, data in DATA.items()}
_TYPE = "float64"
CYCLE_SCHEMA = "\n".join(f"{_TYPE} {name}" for name in CHANNEL_NAMES).encode()
EVENT_SCHEMA = json.dumps(
    {
        "title": "foxglove.Log",
        "type": "object",
        "properties": {
            "timestamp": {
                "type": "object",
                "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
            },
            "level": {"type": "integer"},
            "message": {"type": "string"},
            "name": {"type": "string", "description": "the kind of event"},
            "data": {"type": ["object", "null"], "description": "what programs read, by kind"},
            "t": {"type": "number", "description": "device time, s"},
        },
    }
).encode()


def cycle_schema(further: tuple[str, ...] = ()) -> bytes:
    """Return the schema of a cycle with these further columns; a ROS name has no capital letter."""
    return b"\n".join((CYCLE_SCHEMA, *(f"{_TYPE} {name.lower()}".encode() for name in further)))


def further_in(schema: bytes) -> tuple[str, ...] | None:
    """Return the further columns of a schema; None if it is not that of a cycle of this version."""
    known, *lines = schema[len(CYCLE_SCHEMA) :].split(b"\n", FURTHER_MAX + 1)
    if not schema.startswith(CYCLE_SCHEMA) or known or len(lines) > FURTHER_MAX:
        return None
    words = [line.decode("ascii", "replace").partition(" ") for line in lines]
    further = tuple(f"{name[:-1]}V" if name.endswith("_v") else name for _, _, name in words)
    sound = all(kind == _TYPE for kind, _, _ in words) and not fault_of(further)
    return further if sound and cycle_schema(further) == schema else None


def to_bytes(rows: NDArray[np.float64]) -> list[bytes]:
    """Return each row of a block as a CDR message: NaN and infinity survive."""
    return [_HEADER + row.tobytes() for row in rows.astype("<f8", copy=False)]


def event_to_bytes(event: Event, at_ns: int) -> bytes:
    """Return an event and its time as a document in JSON.

    Parameters
    ----------
    event
        Its time is kept to the bit.
    at_ns
        The same instant, ns since 1970.
    """
    document: dict[str, Any] = {
        "timestamp": {"sec": at_ns // 10**9, "nsec": at_ns % 10**9},
        "level": _LEVELS[event.level],
        "message": event.text[:_TEXT_CHARS_MAX],
        "name": event.kind.value,
        "data": event.data._asdict() if event.data else None,
        "t": event.t,
    }
    return json.dumps(document).encode()


def event_from(document: Mapping[str, Any]) -> Event:
    """Return the event in a JSON object; a kind that this version does not know is OTHER.

    Raises
    ------
    ValueError
        If something is missing, or the data are not those of the kind.
    """
    try:
        t, level = float(document["t"]), _FROM_LEVELS[document["level"]]
        name, text, data = document["name"], readable(str(document["message"])), document["data"]
        if name not in set(EventKind):
            return Event(t, level, EventKind.OTHER, text)
        kind = EventKind(name)
        if kind not in _ADAPTERS or (data is None and kind in OPTIONAL_DATA):
            return Event(t, level, kind, text)
        return Event(t, level, kind, text, _ADAPTERS[kind].validate_python(data))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ValueError("an event that this version cannot read") from error
