"""Free space on the disk of a file, and the part reserved for the run's data."""

from __future__ import annotations

import math
import shutil
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

_DATA_RESERVE_BYTES_MAX = 256e6  # bytes: half an hour of run.mcap at 1 kHz
_DATA_RESERVE_SHARE = 0.25  # of a small disk


def room_for(file: Path) -> float:
    """Return by how many bytes a file may grow: what is free on its disk, or the limit of this process."""
    room = math.inf
    with suppress(OSError):
        room = shutil.disk_usage(file.parent).free
    with suppress(ImportError):  # not POSIX
        import resource

        limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
        if limit != resource.RLIM_INFINITY:
            room = min(room, limit - size_of(file))
    return room


def kept_for_data(file: Path) -> float:
    """Return the bytes of a disk that a picture of a run leaves to its data: 256 MB, a quarter at most."""
    try:
        return min(_DATA_RESERVE_BYTES_MAX, _DATA_RESERVE_SHARE * shutil.disk_usage(file.parent).total)
    except OSError:
        return 0.0


def short_of(file: Path, needed: float) -> bool:
    """Return whether less than `needed` bytes are free on the disk of a file."""
    try:
        return shutil.disk_usage(file.parent).free < needed
    except OSError:
        return False


def size_of(file: Path) -> int:
    """Return the bytes of a file; 0 if it is not there."""
    try:
        return file.stat().st_size
    except OSError:
        return 0
