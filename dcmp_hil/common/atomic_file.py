"""Files that appear wholly or not at all: written beside, then renamed."""

from __future__ import annotations

import os
import stat
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_SUFFIX_CHARS_MAX = 16  # characters of a name's ending that are kept


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield where to write; what is there takes the place of `path` if nothing is raised.

    A device, a pipe, or a file in a folder where no other file can be made is written in place.

    Raises
    ------
    OSError, ValueError
        If it cannot be renamed, or what was written cannot be kept.
    """
    beside = place_beside(path)
    if beside is None:
        yield path
        return
    place = real(path)
    try:
        yield beside
        if place.exists():
            beside.chmod(stat.S_IMODE(place.stat().st_mode))
        beside.replace(place)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """Write a file so that it holds what it did before, or all of `text`.

    Raises
    ------
    OSError, ValueError
        If it cannot be written.
    """
    with whole_file(path) as place:
        place.write_text(text, encoding="utf-8")


def place_beside(path: Path) -> Path | None:
    """Return a name in the same folder, for a file that is to take the place of `path` at once.

    None where that cannot be: for a device or a pipe, or a folder in which no file can be made.
    """
    place = real(path)
    if is_special(path) or not os.access(place.parent, os.W_OK | os.X_OK):
        return None
    return place.with_name(f".{os.getpid()}{place.suffix[:_SUFFIX_CHARS_MAX]}.part")


def real(path: Path) -> Path:
    """Return where links lead; the path itself where the current folder is gone."""
    try:
        return Path(os.path.realpath(path))
    except (OSError, ValueError):
        return path


def is_special(path: Path) -> bool:
    """Return whether something is there that is no ordinary file: a device, a pipe."""
    return path.exists() and not path.is_file()
