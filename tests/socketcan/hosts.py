"""`dcmp-hil` in a process of its own, without the seconds that its imports take in the machine."""

from __future__ import annotations

import multiprocessing
import os
import sys
from typing import TYPE_CHECKING, NoReturn

from dcmp_hil.cli import main

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from pathlib import Path

TIMEOUT_S = 20.0


class Host:
    """A process that waits to be told what to run.

    It is made before there are threads, of which it would be a copy.
    """

    def __init__(self, folder: Path) -> None:
        ours = multiprocessing.get_context("fork")
        self._printed = folder / "printed.txt"
        self._order, theirs = ours.Pipe()
        self._process = ours.Process(target=_serve, args=(theirs, self._printed))
        self._process.start()
        theirs.close()

    def start(self, *arguments: str) -> None:
        """Start the process."""
        self._order.send(arguments)

    @property
    def ended(self) -> bool:
        """Return whether the process has ended."""
        return not self._process.is_alive()

    def wait(self) -> int | None:
        """Return the exit code; None if it did not end in time."""
        self._process.join(TIMEOUT_S)
        return self._process.exitcode

    def printed(self) -> str:
        """Return the output of the process on one line."""
        return " ".join(self._printed.read_text().split())

    def close(self) -> None:
        """Kill the process, in any state."""
        self._process.kill()
        self._process.join()
        self._order.close()


def _serve(order: Connection, printed: Path) -> NoReturn:
    with printed.open("wb") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)
    sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
    sys.argv = ["dcmp-hil", *order.recv()]
    main()
    sys.exit(0)
