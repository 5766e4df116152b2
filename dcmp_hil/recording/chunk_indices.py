"""The index of a recording's chunks while it is written: a few bytes a chunk instead of an object of 500.

At 33 chunks a second the objects would be half a gigabyte after eight hours, and packed to 48 bytes each
still 46 MB. Most of an index follows from the index before it, so blocks of them are kept as what does not.
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np
from mcap.records import ChunkIndex

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

_PACKED = struct.Struct("<5Q4q")
_COLUMN_COUNT = _PACKED.size // 8
_FIRST_TIME, _LAST_TIME, _START, _LENGTH, _INDEXED, _COMPRESSED = range(6)
_OFFSET_COLUMNS = slice(7, 9)  # of the index of each channel, from the beginning of the chunk
_BLOCK_CHUNKS = 512  # chunks: 15 s at 1 kHz
_ABSENT_OFFSET = 0


class ChunkIndices:
    """In the place of the writer's own list: takes what is appended, gives it back in order.

    Parameters
    ----------
    channels
        The two channels that a chunk may hold.
    """

    def __init__(self, channels: tuple[int, int]) -> None:
        self._channels = channels
        self._compression = ""  # the same for every chunk
        self._blocks: list[bytes] = []
        self._newest = bytearray()  # fewer than a block

    def append(self, index: ChunkIndex) -> None:
        """Append the index of a chunk."""
        start = index.chunk_start_offset
        self._compression = index.compression
        self._newest += _PACKED.pack(
            index.message_start_time,
            index.message_end_time,
            start,
            index.chunk_length,
            index.message_index_length,
            index.compressed_size,
            index.uncompressed_size,
            *(index.message_index_offsets.get(channel, start) - start for channel in self._channels),
        )
        if len(self._newest) == _BLOCK_CHUNKS * _PACKED.size:
            self._blocks.append(_pressed(self._newest))
            self._newest.clear()

    def __len__(self) -> int:
        """Count the chunks."""
        return len(self._blocks) * _BLOCK_CHUNKS + len(self._newest) // _PACKED.size

    def __iter__(self) -> Iterator[ChunkIndex]:
        """Yield the index of each chunk."""
        for block in self._blocks:
            yield from self._indices(_unpressed(block))
        yield from self._indices(bytes(self._newest))

    @property
    def size(self) -> int:
        """Bytes that are kept."""
        return sum(map(len, self._blocks)) + len(self._newest)

    def _indices(self, packed: bytes) -> Iterator[ChunkIndex]:
        for first, last, start, length, indexed, compressed, uncompressed, *offsets in _PACKED.iter_unpack(
            packed
        ):
            yield ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=self._compression,
                compressed_size=compressed,
                message_end_time=last,
                message_index_length=indexed,
                message_index_offsets={
                    channel: start + offset
                    for channel, offset in zip(self._channels, offsets, strict=True)
                    if offset != _ABSENT_OFFSET
                },
                message_start_time=first,
                uncompressed_size=uncompressed,
            )


def _pressed(packed: bytearray) -> bytes:
    """Compress a block; in integers that wrap around, so that every number comes back, likely or not."""
    rows = np.frombuffer(bytes(packed), np.int64).reshape(-1, _COLUMN_COUNT).copy()
    rows[:, _OFFSET_COLUMNS] -= rows[:, [_LENGTH]]
    rows[:, _LENGTH] -= rows[:, _COMPRESSED]
    rows[:, _LAST_TIME] -= rows[:, _FIRST_TIME]
    rows[1:, _FIRST_TIME] = np.diff(rows[:, _FIRST_TIME])
    size = rows[:, _LENGTH] + rows[:, _COMPRESSED] + rows[:, _INDEXED]  # of a chunk and its index
    rows[1:, _START] = np.diff(rows[:, _START]) - size[:-1]
    return zlib.compress(rows.T.tobytes())


def _unpressed(block: bytes) -> bytes:
    """Return a block as it was packed."""
    columns: NDArray[np.int64] = np.frombuffer(zlib.decompress(block), np.int64).reshape(_COLUMN_COUNT, -1)
    rows = columns.T.copy()
    size = rows[:, _LENGTH] + rows[:, _COMPRESSED] + rows[:, _INDEXED]
    rows[1:, _START] += size[:-1]
    rows[:, _START] = np.cumsum(rows[:, _START])
    rows[:, _FIRST_TIME] = np.cumsum(rows[:, _FIRST_TIME])
    rows[:, _LAST_TIME] += rows[:, _FIRST_TIME]
    rows[:, _LENGTH] += rows[:, _COMPRESSED]
    rows[:, _OFFSET_COLUMNS] += rows[:, [_LENGTH]]
    return rows.tobytes()
