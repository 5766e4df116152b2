"""Files that a command writes: each place is tried before the work begins, and text is written wholly."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError
from dcmp_hil.whole_file import is_special, real

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

_REMEDY = "Choose a file you may write, in a folder that exists."


def try_places(places: Mapping[str, Path | None], inputs: Mapping[str, Path] | None = None) -> None:
    """Look whether files could be written, without making, changing or touching any.

    Parameters
    ----------
    places
        Option to file; None is nowhere.
    inputs
        What is read, in words, to its file: nothing is written there.

    Raises
    ------
    ConfigError
        With a sentence for each place that cannot be written, or that another one is already.
    """
    faults: list[str] = []
    taken = {real(path): f"is {what} itself" for what, path in (inputs or {}).items()}
    for option, path in places.items():
        if path is None:
            continue
        reason = _fault(path)
        if reason:
            faults.append(f"{option} {path}: {reason}. {_REMEDY}")
            continue
        place = real(path)
        if place in taken:
            faults.append(f"{option} {path}: {taken[place]}. Write elsewhere.")
        if not is_special(path):
            taken[place] = f"is where {option} goes, too"
    if faults:
        raise ConfigError(*faults)


def try_folder(option: str, folder: Path) -> None:
    """Look whether a folder is there, or could be made, and could be written.

    Raises
    ------
    ConfigError
        If not.
    """
    place = real(folder)
    try:
        while not place.exists():
            place = place.parent
        reason = _fault_of_folder(place)
    except (OSError, ValueError) as error:
        reason = _words(error)
    if reason:
        raise ConfigError(f"{option} {folder}: {reason}. Choose a folder you may write in.")


def json_place(target: str | None) -> Path | None:
    """Return the file that `--json` names; None for standard output, or nothing."""
    return None if target in {None, "-"} else Path(str(target))


def write_each(jobs: Sequence[tuple[Path | None, Callable[[Path], None]]]) -> tuple[list[Path], list[str]]:
    """Write files, each whether another one fails or not.

    Returns
    -------
    tuple
        What was written, and a sentence for each that was not: to be printed, and raised, after the figures.
    """
    written: list[Path] = []
    faults: list[str] = []
    for path, write in jobs:
        if path is None:
            continue
        try:
            write(path)
        except ConfigError as error:
            faults += error.faults
        else:
            written.append(path)
    return written, faults


def _fault(path: Path) -> str:
    """Return why a file could not be written; nothing if it could."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return _fault_of_folder(real(path).parent)
    except (OSError, ValueError) as error:  # ValueError: a NUL
        return _words(error)
    if stat.S_ISDIR(mode):
        return "it is a folder"
    return "" if os.access(path, os.W_OK) else "it may not be written"


def _fault_of_folder(folder: Path) -> str:
    try:
        mode = folder.stat().st_mode
    except FileNotFoundError:
        return f"there is no folder {folder}"
    except OSError as error:
        return _words(error)
    if not stat.S_ISDIR(mode):
        return f"{folder} is no folder"
    return "" if os.access(folder, os.W_OK | os.X_OK) else f"{folder} may not be written"


def _words(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)
