"""The folder of compiled files: only files that this user wrote, whole, are loaded from it."""

from __future__ import annotations

import hashlib
import os
import stat
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.errors import OpenError
from dcmp_hil.platform.user_folder import private, temporary

if TYPE_CHECKING:
    from collections.abc import Iterator

_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_OWNER_ONLY_MODE = 0o700
_DIGEST_CHARS = 16  # hexadecimal digits of the content's SHA-256 in a file's name


@contextmanager
def folder(key: str, what: str) -> Iterator[Path]:
    """Open the folder of one set of sources, flags and compiler; only this user may write in it.

    Parameters
    ----------
    key
        Name of the folder.
    what
        What is compiled, for messages.

    Raises
    ------
    OpenError
        If it cannot be made or written, or belongs to another user.
    """
    place = _root(what) / key
    try:
        place.parent.parent.mkdir(parents=True, exist_ok=True)
        for one in (place.parent, place):
            one.mkdir(mode=_OWNER_ONLY_MODE, exist_ok=True)
            _restrict(one)
        yield place
    except OSError as error:
        raise _unwritable(place, error, what) from error


def find(place: Path, name: str) -> Path | None:
    """Return the kept file of that name; None if there is none that is whole and this user's own.

    A file is named after its content, so that one that was cut or altered does not fit its name.
    """
    for path in sorted(place.glob(_named(name, "*"))):
        if _is_own(path) and path.name == _named(name, _digest(path)):
            return path
        with suppress(OSError):
            path.unlink()
    return None


def keep(made: Path, place: Path) -> Path:
    """Move a compiled file into its folder, under the name of its content; return where it is."""
    made.chmod(_OWNER_ONLY_MODE)
    return made.replace(place / _named(made.name, _digest(made)))


def _named(name: str, digest: str) -> str:
    stem, dot, suffix = name.partition(".")
    return f"{stem}-{digest}{dot}{suffix}"


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:_DIGEST_CHARS]


def _is_own(path: Path) -> bool:
    found = path.lstat()
    return stat.S_ISREG(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & _OTHERS_WRITE


def _restrict(place: Path) -> None:
    """Restrict write access to this user's folder to this user.

    Raises
    ------
    OpenError
        If it is another user's, or no folder.
    """
    found = place.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise OpenError(
            f"{place}: it is no folder of this user, and programs are loaded from it. Point "
            "XDG_CACHE_HOME at a folder of your own."
        )
    if found.st_mode & _OTHERS_WRITE:
        place.chmod(_OWNER_ONLY_MODE)


def _root(what: str) -> Path:
    """Return the folder of what was compiled; for a user without a home one beside those of others.

    Raises
    ------
    OpenError
        If there is none that is this user's alone.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    if base:
        return Path(base) / "dcmp-hil"
    try:
        return Path.home() / ".cache" / "dcmp-hil"
    except RuntimeError:  # an id without an entry in the table of users, such as a container's
        pass
    try:
        return private(temporary())
    except OSError as error:
        raise _unwritable(Path(error.filename or "TMPDIR"), error, what) from None


def _unwritable(place: Path, error: OSError, what: str) -> OpenError:
    return OpenError(
        f"{place}: {error.strerror or error}. {what[0].upper()}{what[1:]} is compiled there; point "
        "XDG_CACHE_HOME at a folder you may write in."
    )
