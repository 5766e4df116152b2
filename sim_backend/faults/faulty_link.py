"""The line to a board with faults on it, piece by piece."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from sim_backend.board.backend import BoardLink

if TYPE_CHECKING:
    from dcmp_hil.wire.frame import Frame
    from sim_backend.board.board import Board
    from sim_backend.faults.listener import FaultListener
    from sim_backend.faults.wire import Way
    from sim_backend.pacer import Pacer

_ENDS = {"cobs": b"\0", "slcan": b"\r"}
_IDENTIFIER_MAX, _PAYLOAD_BYTES_MAX = 0x7FF, 8


class LineFaults(Protocol):
    """Protocol of the faults on a line, whose time is that of the board."""

    listener: FaultListener

    def tick(self) -> None:
        """Begin a period."""
        ...

    def passed(self, piece: bytes, way: Way) -> list[bytes]:
        """Return the pieces that arrive at once after `piece` was sent."""
        ...

    def released(self, way: Way) -> list[bytes]:
        """Return the delayed pieces that are due now."""
        ...


class FaultyLink(BoardLink):
    """A BoardLink on which what is sent passes the wire's faults, and in which time can pass unnoticed.

    Parameters
    ----------
    board, carrier, pace
        As for BoardLink.
    faults
        What goes wrong.
    """

    def __init__(self, board: Board, carrier: str, pace: Pacer, faults: LineFaults) -> None:
        super().__init__(board, carrier, pace)
        self._faults = faults
        self._end = _ENDS.get(carrier)
        self._rest = b""

    def send(self, frame: Frame) -> None:
        """Pass a frame, changed by the faults, to the board."""
        number, data = frame
        piece = number.to_bytes(2, "little") + data if self._encode is None else self._encode(frame)
        for arriving in self._faults.passed(piece, "up"):
            self._deliver(arriving)

    def elapse(self, periods: int) -> None:
        """Run the board while the host does nothing."""
        for _ in range(periods):
            self._let_tick()
            self._fetch()

    def _let_tick(self) -> None:
        faults = self._faults
        faults.tick()
        for piece in faults.released("up"):
            self._deliver(piece)
        super()._let_tick()

    def _fetch(self) -> None:
        faults = self._faults
        pieces = self._sent()
        for piece in pieces:
            faults.listener.said(piece)
        arriving = [end for piece in pieces for end in faults.passed(piece, "down")]
        for piece in faults.released("down") + arriving:
            self._take(piece)
        faults.listener.fetched()

    def _sent(self) -> list[bytes]:
        if self._end is None:
            return [number.to_bytes(2, "little") + data for number, data in self._board.transmit_frames()]
        *pieces, self._rest = (self._rest + self._board.transmit()).split(self._end)
        return [piece + self._end for piece in pieces]

    def _deliver(self, piece: bytes) -> None:
        self._faults.listener.heard(piece)
        if self._receiver is not None:
            self._board.receive(piece)
        else:
            self._board.receive_frame(*_frame(piece))

    def _take(self, piece: bytes) -> None:
        self._frames.extend(self._receiver.feed(piece) if self._receiver is not None else [_frame(piece)])


def _frame(piece: bytes) -> Frame:
    """Make the frame of a piece, however damaged."""
    return int.from_bytes(piece[:2], "little") & _IDENTIFIER_MAX, piece[2 : 2 + _PAYLOAD_BYTES_MAX]
