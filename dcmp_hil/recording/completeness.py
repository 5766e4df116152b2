"""Check of a recording's end, without reading the rest: whether it is complete."""

from __future__ import annotations

import json
import os
import struct
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.recording.mcap_records import HEAD, MAGIC, Op, RecordError, attachment_in
from dcmp_hil.recording.schema import END

if TYPE_CHECKING:
    from pathlib import Path

_FOOTER = struct.Struct("<BQQQI")
_DATA_END_BYTES = HEAD.size + 4  # bytes
_ATTACHMENT_BYTES_MAX = 1 << 16  # bytes of the attachment at the end


class Ending(NamedTuple):
    """Facts that are written at the end of a recording.

    Parameters
    ----------
    periods
        How many there were.
    missing
        Device time from and to, s, and number of periods of what a full disk cost.
    """

    periods: int
    missing: tuple[tuple[float, float, int], ...]


def ending_of(path: Path) -> Ending | None:
    """Return how a recording says that it ended; None where it does not end as it should."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - _ATTACHMENT_BYTES_MAX))
            tail = file.read()
            footer_at = len(tail) - len(MAGIC) - _FOOTER.size
            if footer_at < 0 or not tail.endswith(MAGIC):
                return None
            opcode, _, summary, _, _ = _FOOTER.unpack_from(tail, footer_at)
            if opcode != Op.FOOTER:
                return None
            end = (summary or size - len(tail) + footer_at) - _DATA_END_BYTES
            file.seek(max(0, end - _ATTACHMENT_BYTES_MAX))
            return _ending_in(file.read(min(end, _ATTACHMENT_BYTES_MAX)))
    except (OSError, ValueError, RecordError):
        return None


def _ending_in(data: bytes) -> Ending | None:
    """Return what the attachment at the very end of `data` says."""
    at = data.rfind(struct.pack("<I", len(END)) + END.encode()) - HEAD.size - 16
    if at < 0:
        return None
    _, length = HEAD.unpack_from(data, at)
    if at + HEAD.size + length != len(data):
        return None
    said = json.loads(attachment_in(data[at + HEAD.size :]).data)
    return Ending(said["periods"], tuple((start, stop, many) for start, stop, many in said["missing"]))
