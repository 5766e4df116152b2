"""A board at the far end of a real port, a pseudo terminal or python-can's virtual bus, in a thread."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import tty
from typing import TYPE_CHECKING, Protocol

import can

if TYPE_CHECKING:
    from sim_backend.board.board import Board

_PATIENT, _BRISK = (
    1.0,
    0.02,
)  # s, wall: how long a tick waits for a host that drives, and for one that does not


class Port(Protocol):
    """The far end."""

    def exchange(self, board: Board, seconds: float) -> bool:
        """Send what the board has, wait for the host, hand over what came; False if nothing did."""
        ...

    def close(self) -> None:
        """Close the host's end of the line."""
        ...


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


class VirtualBus:
    """The far end of python-can's virtual bus."""

    def __init__(self, channel: str) -> None:
        self.channel = channel
        self._bus = can.Bus(channel=channel, interface="virtual", ignore_config=True)

    def exchange(self, board: Board, seconds: float) -> bool:
        self._send(board)
        message = self._bus.recv(seconds)
        if message is None:
            return False
        board.receive_frame(message.arbitration_id, bytes(message.data))
        self._send(board)
        return True

    def close(self) -> None:
        self._bus.shutdown()

    def _send(self, board: Board) -> None:
        for number, data in board.transmit_frames():
            self._bus.send(can.Message(arbitration_id=number, data=data, is_extended_id=False))


class Pump(threading.Thread):
    """Ticks a board in step with its host: each tick waits for the host's answer, but not for ever.

    While a host drives, it waits so long that a computer that is busy elsewhere changes nothing.
    """

    def __init__(self, board: Board, port: Port) -> None:
        super().__init__(name="board", daemon=True)
        self.board, self.port = board, port
        self.patience = _PATIENT
        self.silent = threading.Event()  # set: the board neither ticks nor speaks
        self._ending = threading.Event()

    def run(self) -> None:
        while not self._ending.is_set():
            if self.silent.is_set():
                self._ending.wait(_BRISK)
                continue
            self.board.tick()
            self.port.exchange(self.board, self.patience if self.board.enable else _BRISK)

    def close(self) -> None:
        """Stop the thread, and wait for its end."""
        self._ending.set()
        self.join(5.0)
        assert not self.is_alive()
        self.port.close()
