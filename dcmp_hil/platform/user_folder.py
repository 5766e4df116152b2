"""Folders of this user alone, where the usual ones are not known or may not be entered."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from pathlib import Path

_OWNER_ONLY_MODE = 0o700


def usable(folder: str) -> bool:
    """Return whether `folder` is an absolute path of a folder that this user may enter and write in."""
    return os.path.isabs(folder) and os.path.isdir(folder) and os.access(folder, os.W_OK | os.X_OK)  # noqa: PTH112, PTH117 - they raise nothing


def temporary() -> Path:
    """Return the place of this user's folder beside those of others; see `private`.

    Raises
    ------
    OSError
        If there is no folder for temporary files.
    """
    return Path(tempfile.gettempdir()) / f"dcmp-hil-{os.getuid()}"


def private(place: Path) -> Path:
    """Return a folder that no other user may enter, made if need be.

    Raises
    ------
    OSError
        If it cannot be made, or is one that another user made, or may enter.
    """
    place.mkdir(mode=_OWNER_ONLY_MODE, exist_ok=True)
    found = place.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise OSError(errno.EPERM, "it is no folder of yours alone", str(place))
    return place
