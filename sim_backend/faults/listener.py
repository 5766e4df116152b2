"""Protocol of a listener to the traffic between host and board during fault injection."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim_backend.board.board import Board


class FaultListener:
    """Told of everything that passes; by default it ignores it."""

    def attached(self, board: Board | None) -> None:
        """Learn which board it is; None on the plain simulated rig."""

    def heard(self, piece: bytes) -> None:
        """Note a piece that reaches the board."""

    def said(self, piece: bytes) -> None:
        """Learn what the board sends, before the wire has it."""

    def fetched(self) -> None:
        """Note the end of the board's tick."""

    def wrote(self, voltage: float) -> None:
        """Learn what the host's loop gives to its backend, V."""
