"""A CAN bus: python-can's virtual one."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import can

if TYPE_CHECKING:
    from sim_backend.board.board import Board

_channels = itertools.count()


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


def _virtual() -> tuple[VirtualBus, tuple[str, ...]]:
    channel = f"contract-{next(_channels)}"
    overrides = ("backend.kind=can", "backend.interface=virtual", f"backend.channel={channel}")
    return VirtualBus(channel), overrides


BENCHES = {"can virtual": _virtual}
