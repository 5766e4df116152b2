"""A process of a sweep: it takes blocks from its parent, one at a time, and answers with their results."""

from __future__ import annotations

import os
import pickle
import struct
import threading
from queue import SimpleQueue
from typing import TYPE_CHECKING

from dcmp_hil.sweeping.executor import SweepBlock

if TYPE_CHECKING:
    import socket

    from dcmp_hil.ipc.child_process import ParentProcess

HEADER = struct.Struct("<Q")
"""Length of what follows, bytes."""


def main(parent: ParentProcess) -> None:
    """Run blocks until the parent hangs up or is gone."""
    work = parent.setup
    blocks: SimpleQueue[SweepBlock] = SimpleQueue()
    threading.Thread(target=_read, args=(parent.channel, blocks), daemon=True).start()
    while True:
        block = blocks.get()
        try:
            answer = (True, work(block))
        except Exception as error:  # noqa: BLE001 - the parent raises it
            answer = (False, error)
        data = pickle.dumps(answer)
        try:
            parent.channel.sendall(HEADER.pack(len(data)) + data)
        except OSError:
            return


def _read(channel: socket.socket, blocks: SimpleQueue[SweepBlock]) -> None:
    """Pass on the blocks that come; end the process with its parent, also in the middle of a block."""
    while (data := receive_bytes(channel)) is not None:
        blocks.put(SweepBlock(*pickle.loads(data)))  # noqa: S301 - written by our own parent
    os._exit(0)


def receive_bytes(channel: socket.socket) -> bytes | None:
    """Return the next message of a stream, waiting for it; None if the other side is gone."""
    channel.settimeout(None)
    header = _exactly(channel, HEADER.size)
    return None if header is None else _exactly(channel, HEADER.unpack(header)[0])


def _exactly(channel: socket.socket, count: int) -> bytes | None:
    found = bytearray()
    while len(found) < count:
        try:
            piece = channel.recv(min(count - len(found), 1 << 20))
        except OSError:
            return None
        if not piece:
            return None
        found += piece
    return bytes(found)
