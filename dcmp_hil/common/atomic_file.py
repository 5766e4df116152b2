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


@contextmanager
def unnamed_file(path: Path) -> Iterator[Path]:
    """Do as `whole_file` with a file that has no name before it is whole, if the file system has such files.

    A process that is killed meanwhile leaves nothing behind. What is yielded leads to the file in this
    process and in others; it is opened and written there, and not replaced.

    Raises
    ------
    OSError, ValueError
        If it cannot be named, or what was written cannot be kept.
    """
    place, beside = real(path), place_beside(path)
    file = None if beside is None else _unnamed(place.parent)
    if beside is None or file is None:
        with whole_file(path) as named:
            yield named
        return
    try:
        yield Path(f"/proc/{os.getpid()}/fd/{file}")
        if place.exists():
            os.fchmod(file, stat.S_IMODE(place.stat().st_mode))
        beside.unlink(missing_ok=True)
        os.link(
            f"/proc/self/fd/{file}", beside, src_dir_fd=0
        )  # without a descriptor, the entry is linked itself
        beside.replace(place)
    finally:
        os.close(file)


def _unnamed(folder: Path) -> int | None:
    """Return the descriptor of a new file without a name; None where there are none, as on NFS."""
    try:
        return os.open(folder, os.O_TMPFILE | os.O_RDWR, 0o666)
    except (AttributeError, OSError):  # the first where this is not Linux
        return None


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
