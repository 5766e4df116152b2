"""What a recording looks like inside: topics, schemas, and a period as bytes that ROS tools read as well."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.telemetry.ring import FIELDS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.values import Event

PROFILE, LIBRARY = "ros2", "dcmp-hil"
FORMAT = "1"
"""Of what is said about a run; a number that this version does not know is refused."""
CYCLES, EVENTS = "/cycles", "/events"
RUN, RIG, SUMMARY = "run", "rig.json", "summary"
"""Names of the metadata that say what the run was, of the attached rig, and of what is known at its end."""

_UNITS = {
    "t": "s", "began": "s", "period": "s", "lateness": "s", "compute": "s", "fault": "",
    "position": "rad", "velocity": "rad_s", "acceleration": "rad_s2", "disturbance": "rad_s2", "voltage": "v",
}  # fmt: skip
_HEADER = b"\0\1\0\0"  # of CDR: little endian
_LEVELS = {"INFO": 2, "WARN": 3, "ERROR": 4, "PHASE": 2, "LINK": 1}  # of foxglove.Log


def _with_unit(field: str) -> str:
    """Return a field's name as a ROS message may have it: lower case, and its unit at the end."""
    unit = _UNITS[field.partition("_")[0]]
    return f"{field}_{unit}" if unit else field


NAMES = tuple(_with_unit(field) for field in FIELDS)
CYCLE_SCHEMA = "\n".join(f"float64 {name}" for name in NAMES).encode()
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
            "name": {"type": "string"},
            "t": {"type": "number", "description": "device time, s"},
        },
    }
).encode()


def to_bytes(rows: NDArray[np.float64]) -> list[bytes]:
    """Return each row, shape (n, len(FIELDS)), as a CDR message: NaN and infinity survive."""
    return [_HEADER + row.tobytes() for row in rows.astype("<f8", copy=False)]


def to_row(message: bytes) -> NDArray[np.float64]:
    """Return the row in a message, shape (len(FIELDS),)."""
    return np.frombuffer(message, "<f8", offset=len(_HEADER))


def event_to_bytes(event: Event, at_ns: int) -> bytes:
    """Return an event as JSON.

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
        "message": event.text,
        "name": event.level,
        "t": event.t,
    }
    return json.dumps(document).encode()
