"""A serial cable between a device's pseudo terminal and a host's, which can be pulled."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import threading
import tty
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from types import TracebackType

_CHUNK_BYTES_MAX = 4096


class Cable:
    """Carries bytes both ways; when it is pulled, both ends see their line go down.

    Parameters
    ----------
    port
        Of the device.
    """

    def __init__(self, port: str) -> None:
        self._device = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._host, self._socket = pty.openpty()
        for end in (self._device, self._socket):
            tty.setraw(end)
        os.set_blocking(self._host, False)
        self.port = os.ttyname(self._socket)
        self._hand, self._wish = os.pipe()  # its write end pulls the cable
        self._loose = self._pulled = False
        self._thread = threading.Thread(target=self._carry, name="cable", daemon=True)

    def __enter__(self) -> Self:
        """Plug the cable in."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Pull the cable, unless it is pulled already."""
        self.pull()

    def loosen(self) -> None:
        """Carry nothing more; both ends are still plugged in."""
        if not self._loose:
            self._loose = True
            os.write(self._wish, b"!")
            self._thread.join()

    def pull(self) -> None:
        """Disconnect both lines, the device's first."""
        if self._pulled:
            return
        self.loosen()
        self._pulled = True
        for end in (self._device, self._host, self._socket, self._hand, self._wish):
            os.close(end)

    def _carry(self) -> None:
        ways = {self._device: self._host, self._host: self._device}
        poll = select.poll()
        for end in (*ways, self._hand):
            poll.register(end, select.POLLIN)
        while True:
            for end, _ in poll.poll():
                if end == self._hand:
                    return
                with contextlib.suppress(OSError):  # no room, or the other side has gone: it is lost
                    os.write(ways[end], os.read(end, _CHUNK_BYTES_MAX))
