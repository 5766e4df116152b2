"""The index of a recording as it is kept in memory: the same as the writer's own, a fraction of its size."""

from __future__ import annotations

import random

import pytest
from mcap.records import ChunkIndex

from dcmp_hil.recording.chunk_indices import ChunkIndices

ENDS = (1, 511, 512, 513, 1024, 1500)  # on both sides of where a block is full
NUMBER_LIMIT = 2**63


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


def of_a_run(n: int) -> list[ChunkIndex]:
    """Return indices as 1 kHz makes them: 31 periods a chunk, an event in one of 30."""
    chance, start, indices = random.Random(5), 2_345, []
    for k in range(n):
        compressed, at = chance.randrange(3_400, 3_700), 1_780_000_000_000_000_000 + 31_000_000 * k
        length = compressed + 57
        offsets = {1: start + length, **({2: start + length + 515} if k % 30 == 0 else {})}
        indexed = 515 + 31 * (k % 30 == 0)
        indices.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression="zstd",
                compressed_size=compressed,
                message_end_time=at + 30_000_000,
                message_index_length=indexed,
                message_index_offsets=offsets,
                message_start_time=at,
                uncompressed_size=7_500,
            )
        )
        start += length + indexed
    return indices


def any_index(chance: random.Random) -> ChunkIndex:
    """Return an index whose numbers have nothing to do with one another."""
    start = chance.randrange(NUMBER_LIMIT)
    return ChunkIndex(
        chunk_length=chance.randrange(NUMBER_LIMIT),
        chunk_start_offset=start,
        compression="zstd",
        compressed_size=chance.randrange(NUMBER_LIMIT),
        message_end_time=chance.randrange(NUMBER_LIMIT),
        message_index_length=chance.randrange(NUMBER_LIMIT),
        message_index_offsets={
            channel: chance.choice((start - 1, start + 1, chance.randrange(NUMBER_LIMIT)))
            for channel in (1, 2)
            if chance.random() < 0.7
        },
        message_start_time=chance.randrange(NUMBER_LIMIT),
        uncompressed_size=chance.randrange(NUMBER_LIMIT),
    )


def kept(given: list[ChunkIndex]) -> ChunkIndices:
    indices = ChunkIndices((1, 2))
    for one in given:
        indices.append(one)
    return indices


def test_every_index_comes_back_as_it_was() -> None:
    given = [index(0, {1: 7_000, 2: 7_300}), index(1, {2: 7_001}), index(2, {1: 9}), index(3, {})]
    assert list(kept(given)) == given


@pytest.mark.parametrize("n", ENDS)
def test_every_index_comes_back_on_both_sides_of_a_full_block(n: int) -> None:
    given = of_a_run(n)
    assert list(kept(given)) == given
    assert len(kept(given)) == n


@pytest.mark.parametrize("seed", range(3))
def test_every_index_comes_back_where_no_number_follows_from_another(seed: int) -> None:
    chance = random.Random(seed)
    given = [any_index(chance) for _ in range(700)]
    assert list(kept(given)) == given


def test_an_index_takes_a_few_bytes() -> None:
    assert kept(of_a_run(2_048)).size < 6 * 2_048
