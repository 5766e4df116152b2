"""Errors of the operating system at a port, in words with a remedy."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.errors import OpenError

if TYPE_CHECKING:
    from collections.abc import Iterator

_BUSY_ERRNOS = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)


def cannot_open(path: str, error: BaseException) -> OpenError:
    """Return the error for a port that cannot be opened, with a remedy.

    Parameters
    ----------
    path
        Of the port.
    error
        What the library raised.
    """
    number = _number_of(error)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return OpenError(
            f"{path}: there is no such port. Plug the device in; `dcmp-hil ports` lists what is there."
        )
    if number in (errno.EACCES, errno.EPERM):
        return OpenError(
            f"{path}: you may not open it. Become a member of its group: sudo usermod -aG dialout $USER, "
            "then log out and in."
        )
    if number in _BUSY_ERRNOS:
        by = holder(path)
        return OpenError(f"{path}: busy{f', {by} has it' if by else ''}. End that first.")
    if number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR):
        return OpenError(f"{path}: no serial port. `dcmp-hil ports` lists those that are.")
    return OpenError(f"{path}: cannot be opened: {error}. `dcmp-hil ports` lists what is there.")


def reason(error: BaseException) -> str:
    """Return the reason in a library's error about a broken port."""
    words = str(error)
    return "the other end has hung up" if "returned no data" in words else words


def _number_of(error: BaseException | None) -> int | None:
    """Return the errno of an error, or of the one that it was raised in place of."""
    while error is not None:
        number = getattr(error, "errno", None)
        if number is None and error.args:
            number = error.args[0]  # where termios.error has it
        if isinstance(number, int):
            return number
        error = error.__cause__ or error.__context__
    return None


def holder(path: str) -> str:
    """Return which other process has a port open, such as `dcmp-hil (process 4711)`; empty if unknown."""
    try:
        wanted = os.stat(path).st_rdev  # noqa: PTH116 - devices are compared by number, not by path
    except OSError:
        return ""
    for process in _processes():
        if process.name != str(os.getpid()) and wanted in _open_devices(process):
            return f"{_command(process)} (process {process.name})"
    return ""


def _processes() -> Iterator[Path]:
    try:
        yield from (entry for entry in Path("/proc").iterdir() if entry.name.isdigit())
    except OSError:  # not Linux
        return


def _open_devices(process: Path) -> Iterator[int]:
    try:
        for entry in (process / "fd").iterdir():
            try:
                yield entry.stat().st_rdev
            except OSError:
                continue
    except OSError:  # another user's, or gone
        return


def _command(process: Path) -> str:
    unknown = "another program"
    try:
        words = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return unknown
    names = [Path(word).name for word in words if word and not word.startswith("-")]
    return names[1] if len(names) > 1 and names[0].startswith("python") else names[0] if names else unknown
