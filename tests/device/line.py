"""The far end of a serial line: says one thing again and again, and keeps every byte that it hears."""

from __future__ import annotations

import os
import select
import threading
import tty
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_PAUSE_S = 5e-3  # s


class Line:
    """A pseudo terminal; `path` is the near end."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._heard = b""

    def say(self, words: bytes) -> None:
        try:
            os.write(self._master, words)
        except BlockingIOError:  # no reader
            return

    def heard(self) -> bytes:
        """Return all that was ever written at the near end."""
        while select.select([self._master], [], [], 0.0)[0]:
            self._heard += os.read(self._master, 4096)
        return self._heard

    def close(self) -> None:
        os.close(self._slave)
        os.close(self._master)


@contextmanager
def line(said: bytes = b"") -> Iterator[Line]:
    """Open a line on which something is said all the time, or nothing."""
    found, ending = Line(), threading.Event()

    def babble() -> None:
        while not ending.wait(_PAUSE_S):
            found.say(said)

    thread = threading.Thread(target=babble)
    thread.start()
    try:
        yield found
    finally:
        ending.set()
        thread.join()
        found.close()
