"""A file that grows by whole pieces: what a full disk refuses waits and is written when there is room."""

from __future__ import annotations

import os
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pathlib import Path

_WAITING_BYTES_MAX = 8 << 20  # bytes that wait at most: a minute at 1 kHz


class Piece(NamedTuple):
    """Bytes that are written together, or not at all.

    Parameters
    ----------
    data
        The bytes.
    start, stop
        Device time of what is in it, s.
    first, last
        Numbers of the periods in it; first > last where there are none.
    """

    data: bytes
    start: float
    stop: float
    first: int
    last: int


class WriteBuffer:
    """A stream for a writer that never fails; `put` writes what it was given, in whole pieces.

    Parameters
    ----------
    path
        The file; it is made anew.
    room
        Bytes that wait at most; beyond them the oldest piece is dropped.

    Attributes
    ----------
    room
        As given.
    dropped
        Pieces that were lost, oldest first, without their bytes.
    refused
        Why the disk takes nothing at the moment; empty while it does.

    Raises
    ------
    OSError
        If the file cannot be made.
    """

    def __init__(self, path: Path, room: int = _WAITING_BYTES_MAX) -> None:
        self._file = path.open("wb", buffering=0)
        self.room = room
        self._made = bytearray()  # of the piece that is being made
        self._waiting: deque[Piece] = deque()
        self._waits = 0  # bytes
        self._told = 0  # bytes that the writer gave
        self._whole = 0  # bytes of the file that are whole pieces
        self.dropped: list[Piece] = []
        self.refused = ""

    def write(self, data: bytes) -> int:
        """Add bytes of the present piece."""
        self._made += data
        self._told += len(data)
        return len(data)

    def tell(self) -> int:
        """Return how many bytes were given: where the next one stands in the file, if none was dropped."""
        return self._told

    def flush(self) -> None:
        """Do nothing: `put` writes."""

    def cut(self, start: float, stop: float, first: int, last: int) -> bool:
        """End the piece, if there is anything in it, and tell whether there was; see `Piece`."""
        if not self._made:
            return False
        self._waiting.append(Piece(bytes(self._made), start, stop, first, last))
        self._waits += len(self._made)
        self._made.clear()
        while self._waits > self.room and len(self._waiting) > 1:
            lost = self._waiting.popleft()
            self._waits -= len(lost.data)
            self.dropped.append(lost._replace(data=b""))
        return True

    def put(self) -> bool:
        """Write what waits, as far as the disk takes it; return whether nothing waits any more."""
        while self._waiting:
            data = self._waiting[0].data
            try:
                self._append(data)
            except OSError as error:
                self.refused = error.strerror or str(error)
                return False
            self._waiting.popleft()
            self._waits -= len(data)
        self.refused = ""
        return True

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _append(self, data: bytes) -> None:
        """Append all of `data`; cut the file back if that fails."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            os.ftruncate(self._file.fileno(), self._whole)
            self._file.seek(self._whole)
            raise
        self._whole += len(data)
