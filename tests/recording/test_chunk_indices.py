"""The index of a recording as it is kept in memory: the same as the writer's own, an eighth of the size."""

from __future__ import annotations

from mcap.records import ChunkIndex

from dcmp_hil.recording.chunk_indices import ChunkIndices


def index(k: int, offsets: dict[int, int]) -> ChunkIndex:
    start = 4_000_000_000 * k + 100
    return ChunkIndex(
        chunk_length=7_000 + k,
        chunk_start_offset=start,
        compression="zstd",
        compressed_size=6_900 + k,
        message_end_time=30_000_000 * (k + 1),
        message_index_length=600,
        message_index_offsets={channel: start + offset for channel, offset in offsets.items()},
        message_start_time=30_000_000 * k,
        uncompressed_size=7_200,
    )


def test_every_index_comes_back_as_it_was() -> None:
    kept = ChunkIndices((1, 2))
    given = [index(0, {1: 7_000, 2: 7_300}), index(1, {2: 7_001}), index(2, {1: 9}), index(3, {})]
    for one in given:
        kept.append(one)
    assert list(kept) == given
    assert len(kept) == len(given)
    assert len(kept._packed) == 48 * len(given)  # noqa: SLF001
