"""A symlink that leads to a port for as long as there is one."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path


class Symlink:
    """A path that the user chose for a port whose own name changes with each run.

    Parameters
    ----------
    path
        Where it is made; a symlink that is there already is replaced, a file is not.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._port = ""

    def make(self, port: str) -> None:
        """Create the symbolic link to a port.

        Raises
        ------
        ConfigError
            If it cannot be made.
        """
        try:
            if self._path.is_symlink():
                self._path.unlink()
            self._path.symlink_to(port)
        except OSError as error:
            raise ConfigError(
                f"--symlink {self._path}: {error.strerror or error}. Choose a path that is free, or a "
                "symlink, in a folder you may write in."
            ) from None
        self._port = port

    def remove(self) -> None:
        """Remove it, if it still leads to the port for which it was made."""
        with suppress(OSError):
            if self._port and str(self._path.readlink()) == self._port:
                self._path.unlink()
