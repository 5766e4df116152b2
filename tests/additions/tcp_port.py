"""The far end of the TCP link, for the contract suite."""

from __future__ import annotations

import contextlib
import select
import socket
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim_backend.board.board import Board


class TcpPort:
    """A listening socket that takes one host after the other."""

    def __init__(self) -> None:
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.number = self._listening.getsockname()[1]
        self._host: socket.socket | None = None

    def exchange(self, board: Board, seconds: float) -> bool:
        sent = board.transmit()
        if self._host is not None and sent:
            with contextlib.suppress(ConnectionError):
                self._host.sendall(sent)
        ends = [self._host or self._listening]
        if not select.select(ends, [], [], seconds)[0]:
            return False
        if self._host is None:
            self._host = self._listening.accept()[0]
            self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return True
        try:
            data = self._host.recv(4096)
            if data:
                board.receive(data)
                self._host.sendall(board.transmit())
                return True
        except ConnectionError:
            pass
        self._host.close()
        self._host = None
        return False

    def close(self) -> None:
        for end in (self._host, self._listening):
            if end is not None:
                end.close()


def _tcp() -> tuple[TcpPort, tuple[str, ...]]:
    port = TcpPort()
    return port, ("backend.kind=tcp", f"backend.tcp_port={port.number}")


BENCHES = {"cobs tcp": _tcp}
