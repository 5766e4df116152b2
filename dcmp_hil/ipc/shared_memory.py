"""Memory that two processes share: files without a name, gone with the last process that holds them."""

from __future__ import annotations

import mmap
import os
import pickle
import struct
import weakref
import zlib
from typing import Any

_HEADER = struct.Struct("QQQ")  # number, length, check sum
_SLOT_BYTES = 1 << 18  # bytes; only those written take memory


def reserve(owner: object, what: str) -> int:
    """Return the descriptor of an empty file in memory, closed when `owner` is forgotten."""
    file = os.memfd_create(f"dcmp-hil {what}")
    weakref.finalize(owner, os.close, file)
    return file


def mapped(file: int, size: int) -> mmap.mmap:
    """Return `size` bytes of `file`, made as long as that and in memory already."""
    if os.fstat(file).st_size < size:
        os.truncate(file, size)
        memory = mmap.mmap(file, size)
        memory.write(bytes(size))  # a page that comes into being later would cost the loop its time
        return memory
    return mmap.mmap(file, size)


class Ledger:
    """An object written over and over; a reader finds the last one written whole.

    Parameters
    ----------
    file
        From `reserve`.
    """

    def __init__(self, file: int) -> None:
        self._file = file
        self._number = 0

    def write(self, value: object) -> None:
        """Write it beside the one before, so that a death on the way harms neither.

        Raises
        ------
        OSError
            If there is no memory left.
        """
        data = pickle.dumps(value)
        if len(data) > _SLOT_BYTES - _HEADER.size:
            raise OSError("too large for the ledger")
        self._number += 1
        place = self._number % 2 * _SLOT_BYTES
        header = _HEADER.pack(self._number, len(data), zlib.crc32(data))
        _write(self._file, header + data, place)

    def read(self) -> Any:
        """Return the last one written whole; None if there is none."""
        found = [self._slot(0), self._slot(_SLOT_BYTES)]
        number, data = max(found, key=lambda slot: slot[0])
        return pickle.loads(data) if number else None  # noqa: S301 - written by our own child

    def _slot(self, place: int) -> tuple[int, bytes]:
        header = os.pread(self._file, _HEADER.size, place)
        if len(header) < _HEADER.size:
            return 0, b""
        number, length, check = _HEADER.unpack(header)
        data = os.pread(self._file, length, place + _HEADER.size)
        return (number, data) if zlib.crc32(data) == check else (0, b"")


class Log:
    """A log of bytes in shared memory, written piece by piece.

    Parameters
    ----------
    file
        From `reserve`.
    length
        Of what is there and counts.
    """

    def __init__(self, file: int, length: int = 0) -> None:
        self.file = file
        self.length = length

    def append(self, data: bytes) -> None:
        """Append bytes to the log.

        Raises
        ------
        OSError
            If there is no memory left; what was written by then does not count.
        """
        _write(self.file, data, self.length)
        self.length += len(data)

    def read(self) -> bytearray:
        """Return the whole contents of the log."""
        data = bytearray(self.length)
        done = 0
        while done < self.length:
            got = os.preadv(self.file, [memoryview(data)[done:]], done)
            if not got:
                raise OSError("a log is shorter than it says")
            done += got
        return data


def _write(file: int, data: bytes, place: int) -> None:
    view = memoryview(data)
    while view:
        done = os.pwrite(file, view, place)
        view, place = view[done:], place + done
