"""Edits of a rig file that are shown as a diff, and written once that is accepted."""

from __future__ import annotations

import difflib
import errno
import os
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.common.atomic_file import place_beside, unnamed_file
from dcmp_hil.config.edited_text import edited_text
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path
    from typing import IO

_BOM = "\ufeff"
_LINES_AROUND = 3  # of the file, shown around a change


class Proposal(NamedTuple):
    """A new text of a rig file, and the text that it was made from."""

    path: Path
    before: bytes
    after: bytes
    diff: str

    def write(self) -> None:
        """Write the new text.

        Raises
        ------
        ConfigError
            If the file is another than the diff was made from, or cannot be written.
        """
        try:
            with self.path.open("rb") as file, unnamed_file(self.path) as place:
                _lock(file)
                if self.path.read_bytes() != self.before:
                    raise ConfigError(
                        f"{self.path}: it was changed meanwhile, and nothing is written. Look at the diff "
                        "again."
                    )
                place.write_bytes(self.after)
        except OSError as error:
            raise ConfigError(f"{self.path}: {error.strerror}. Nothing is written.") from None


def _lock(file: IO[bytes]) -> None:
    """Keep other writers of a file away until it is closed; where it cannot be locked, go on without.

    Raises
    ------
    BlockingIOError
        If another one writes it.
    """
    try:
        import fcntl  # not everywhere

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BlockingIOError(errno.EAGAIN, "another program is writing it") from None
    except (ImportError, OSError):  # some file systems of a network have no locks
        return


def is_file(source: str) -> bool:
    """Return whether a rig is meant as a file, by the rule of `load_rig`, and not as a shipped one."""
    return source.endswith(".toml") or "/" in source


def propose(path: Path, overrides: Sequence[str]) -> Proposal:
    """Return what would put overrides into a rig file; every other line stays as it is.

    Raises
    ------
    ConfigError
        If the file cannot be read, edited or written.
    """
    if place_beside(path) is None or not os.access(path, os.W_OK):
        raise ConfigError(f"{path}: it may not be written. Put these into another: {', '.join(overrides)}")
    try:
        before = path.read_bytes()
        text = before.decode("utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: not UTF-8 text. Save the file as UTF-8.") from None
    mark = _BOM if text.startswith(_BOM) else ""
    after = mark + edited_text(text.removeprefix(_BOM), overrides, path.name)
    return Proposal(path, before, after.encode(), _diff(text, after, path.name))


def _diff(before: str, after: str, name: str) -> str:
    old, new = before.splitlines(), after.splitlines()
    return "\n".join(difflib.unified_diff(old, new, name, f"{name} (new)", n=_LINES_AROUND, lineterm=""))
