"""Files that a command writes: each place is tried before the work begins, and text is written wholly."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.common.atomic_file import is_special, real
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

_REMEDY = "Choose a file you may write, in a folder that exists."


def try_places(
    places: Mapping[str, Path | None], inputs: Mapping[str, Path] | None = None, *, force: bool = False
) -> None:
    """Check that files can be written, without creating or changing any.

    Parameters
    ----------
    places
        Option to file; None if the option was not given.
    inputs
        What is read, in words, to its file: no output is ever written to this file, by any of its names.
    force
        Whether a file that is there may be overwritten.

    Raises
    ------
    ConfigError
        With a sentence for each place that cannot be written, or that another one is already.
    """
    faults: list[str] = []
    taken: dict[Path, str] = {}
    for option, path in places.items():
        if path is None:
            continue
        reason = _fault(path)
        if reason:
            faults.append(f"{option} {path}: {reason}. {_REMEDY}")
            continue
        reason = _refusal(path, inputs or {}, taken, force=force)
        if reason:
            faults.append(f"{option} {path}: {reason}")
        if not is_special(path):
            taken[real(path)] = option
    if faults:
        raise ConfigError(*faults)


def _refusal(path: Path, inputs: Mapping[str, Path], taken: Mapping[Path, str], *, force: bool) -> str:
    """Return why nothing may be written there though it could be; nothing if it may."""
    for what, other in inputs.items():
        if _same(path, other):
            return f"is {what} itself. Write elsewhere."
    if real(path) in taken:
        return f"is where {taken[real(path)]} goes, too. Write elsewhere."
    if not force and path.is_file():
        return "is there already. Write elsewhere, or overwrite it with --force."
    return ""


def try_folder(option: str, folder: Path) -> None:
    """Check that a folder exists or can be created, and can be written.

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


def _same(path: Path, other: Path) -> bool:
    """Return whether both are one file: by another spelling, a link of either kind, or in other letters."""
    if real(path) == real(other):
        return True
    try:
        return path.samefile(other)
    except (OSError, ValueError):  # one of them is not there
        return False


def free_name(path: Path) -> Path:
    """Return a name that is free: the file itself, or with the first number that none has."""
    names = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in range(2, 10_000))
    return next((name for name in (path, *names) if not name.exists()), path)


def _words(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)
