"""The line to a board with faults on it, piece by piece."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim_backend.board.backend import BoardLink

if TYPE_CHECKING:
    from dcmp_hil.wire.frame import Frame
    from sim_backend.board.board import Board
    from sim_backend.faults.injector import Injector
    from sim_backend.pacer import Pacer

_ENDS = {"cobs": b"\0", "slcan": b"\r"}
_HIGHEST, _LONGEST = 0x7FF, 8


class FaultyLink(BoardLink):
    """A BoardLink on which what is sent passes the wire's faults, and in which time can pass unnoticed.

    Parameters
    ----------
    board, carrier, pace
        As for BoardLink.
    injection
        What goes wrong.
    """

    def __init__(self, board: Board, carrier: str, pace: Pacer, injection: Injector) -> None:
        super().__init__(board, carrier, pace)
        self._injection = injection
        self._end = _ENDS.get(carrier)
        self._rest = b""

    def send(self, frame: Frame) -> None:
        """Hand a frame, or what is left of it, to the board."""
        number, data = frame
        piece = number.to_bytes(2, "little") + data if self._encode is None else self._encode(frame)
        for arriving in self._injection.passed(piece, "up"):
            self._deliver(arriving)

    def elapse(self, periods: int) -> None:
        """Let the board go on while the host does nothing."""
        for _ in range(periods):
            self._let_tick()
            self._fetch()

    def _let_tick(self) -> None:
        injection = self._injection
        injection.tick()
        for piece in injection.released("up"):
            self._deliver(piece)
        super()._let_tick()

    def _fetch(self) -> None:
        injection = self._injection
        pieces = self._sent()
        for piece in pieces:
            injection.listener.said(piece)
        arriving = [end for piece in pieces for end in injection.passed(piece, "down")]
        for piece in injection.released("down") + arriving:
            self._take(piece)
        injection.listener.fetched()

    def _sent(self) -> list[bytes]:
        if self._end is None:
            return [number.to_bytes(2, "little") + data for number, data in self._board.transmit_frames()]
        *pieces, self._rest = (self._rest + self._board.transmit()).split(self._end)
        return [piece + self._end for piece in pieces]

    def _deliver(self, piece: bytes) -> None:
        self._injection.listener.heard(piece)
        if self._receiver is not None:
            self._board.receive(piece)
        else:
            self._board.receive_frame(*_frame(piece))

    def _take(self, piece: bytes) -> None:
        self._frames.extend(self._receiver.feed(piece) if self._receiver is not None else [_frame(piece)])


def _frame(piece: bytes) -> Frame:
    """Make the frame of a piece, however damaged."""
    return int.from_bytes(piece[:2], "little") & _HIGHEST, piece[2 : 2 + _LONGEST]
