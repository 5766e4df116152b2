"""A recording rewritten at its end: fewer and longer chunks, and the footer that makes random access fast.

What is written during a run has short chunks and no footer, which would take memory for every chunk.
"""

from __future__ import annotations

import os
import subprocess
from typing import TYPE_CHECKING

from dcmp_hil.common.atomic_file import place_beside, unnamed_file
from dcmp_hil.platform.disk_space import short_of, size_of
from dcmp_hil.platform.parent_death import tied
from dcmp_hil.telemetry.rerun.viewer import viewer_binary, viewer_environment

if TYPE_CHECKING:
    from pathlib import Path

_FILE_BYTES_MIN = 4e6  # bytes: 15 s at 1 kHz, of which there is nothing to gain
_FILE_BYTES_MAX = 100e6
"""Bytes, 7 minutes at 1 kHz: Rerun holds the file in memory, 2.5 times its size, and takes 2 s for it."""
_FOOTER_MARK = b"RRF2FOOT"
_TRAILER_BYTES = 32  # at the end of a file, with the mark of a footer in them


def optimise(file: Path, within: float, kept: float = 0.0) -> bool:
    """Rewrite a finished recording, or leave it as it is.

    The new file takes the place of the old one when it is whole and on the disk, so that at every moment
    there is one or the other; a process that is killed leaves no other file.

    Parameters
    ----------
    file
        The .rrd file, which is not written any more.
    within
        s after which it is given up.
    kept
        Bytes that stay free on the disk beside the second file.

    Returns
    -------
    bool
        Whether it was rewritten.
    """
    size = size_of(file)
    if not _FILE_BYTES_MIN <= size <= _FILE_BYTES_MAX or within <= 0.0:
        return False
    if place_beside(file) is None or short_of(file, size + kept):
        return False
    try:
        with unnamed_file(file) as place:
            _rewrite(file, place, within)
    except (OSError, ValueError, subprocess.SubprocessError):
        return False
    return True


def _rewrite(file: Path, place: Path, within: float) -> None:
    """Write the new file.

    Raises
    ------
    OSError, ValueError, subprocess.SubprocessError
        If it does not become whole in that time.
    """
    command = [str(viewer_binary()), "rrd", "optimize", "--profile", "live", str(file), "-o", str(place)]
    subprocess.run(  # noqa: S603 - the binary of our own dependency
        tied(command),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=viewer_environment(),
        start_new_session=True,  # Ctrl-C ends a run, and not this
        timeout=within,
        check=True,
    )
    with place.open("rb+") as written:
        written.seek(-min(_TRAILER_BYTES, size_of(place)), os.SEEK_END)
        if _FOOTER_MARK not in written.read():
            raise ValueError(f"{place} has no footer")
        os.fsync(written.fileno())
