"""Warnings of a dashboard that is incomplete or missing."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.platform.disk_space import room_for

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.telemetry.rerun.stream_worker import StreamWorker

_STUCK = (
    "The viewer has taken nothing for seconds and is left behind; the run goes on. "
    "Close that viewer and open another."
)
_SCARCE_BYTES = 100e6  # bytes free below which a disk is the likely cause
NO_ROOM = (
    "{file}: there is room for {room:.0f} kB, and a recording begins with up to {beginning:.0f} kB. Free "
    "some space, or record elsewhere (--record FILE.rrd) or not at all (--no-record)."
)
_FULL_DISK_NOTE = (
    "{file} {what}: less than {needed:.3g} MB are free on its disk, and the data in run.mcap come first. "
    "The run goes on. Free some space; `dcmp-hil export FOLDER --rrd FILE` makes the dashboard afterwards."
)
OTHER_USERS_WARNING = (
    "Another user of this computer (number {user}) connected to the dashboard on port {port}: it is not "
    "served any more. The run and its files go on, and take nothing from a viewer."
)
NO_WINDOW = (
    "The viewer ended by itself (exit code {code}; process.log in the run's folder has its words). "
    "The run is served on port {port}: dcmp-hil view --port {port} --web"
)


def stuck(outlet: StreamWorker) -> str:
    """Return the warning for an outlet that no longer takes data."""
    if outlet.file is None:
        return _STUCK
    return f"{incomplete(outlet, f'it did not grow for {outlet.stalled:.0f} s')} The run goes on."


def incomplete(outlet: StreamWorker, reason: str) -> str:
    """Return the warning for an incomplete recording or view, with the measured figures."""
    if outlet.file is None:
        return f"What the viewer shows is incomplete: {reason}."
    measured = f"{1e-6 * outlet.size():.1f} MB are in it"
    remedy = ""
    room = room_for(outlet.file)
    if math.isfinite(room):
        measured += f", there is room for {1e-9 * room:.1f} GB more"
        remedy = " Free some space." if room < _SCARCE_BYTES else ""
    return f"The recording is incomplete: {reason.rstrip('.')} ({measured}).{remedy}"


def spared(file: Path, what: str, needed: float) -> str:
    """Return the note that a file ends, or is not written, to leave space for the data of the run."""
    return _FULL_DISK_NOTE.format(file=file, what=what, needed=1e-6 * needed)
