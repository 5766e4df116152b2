"""A board at the far end of a real port, in a thread; the ports are in the folder beside."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Protocol

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
