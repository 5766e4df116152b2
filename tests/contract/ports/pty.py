"""A serial port: the master of a pseudo terminal."""

from __future__ import annotations

import contextlib
import os
import select
import tty
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim_backend.board.board import Board


class PtyPort:
    """The master of a pseudo terminal."""

    def __init__(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave = slave  # stays open, or the master would hang up between two hosts
        os.set_blocking(self._master, False)

    def exchange(self, board: Board, seconds: float) -> bool:
        self._send(board.transmit())
        ready, _, _ = select.select([self._master], [], [], seconds)
        if not ready:
            return False
        board.receive(os.read(self._master, 4096))
        self._send(board.transmit())
        return True

    def close(self) -> None:
        os.close(self._slave)
        os.close(self._master)

    def _send(self, data: bytes) -> None:
        with contextlib.suppress(BlockingIOError):  # no reader
            os.write(self._master, data)


def _cobs() -> tuple[PtyPort, tuple[str, ...]]:
    port = PtyPort()
    return port, ("backend.kind=serial", f"backend.port={port.path}")


def _slcan() -> tuple[PtyPort, tuple[str, ...]]:
    port = PtyPort()
    return port, ("backend.kind=can", "backend.interface=slcan", f"backend.channel={port.path}")


BENCHES = {"cobs pty": _cobs, "slcan pty": _slcan}
