"""Bytes between two contexts: all or nothing in, in order out, across every wrap."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

if TYPE_CHECKING:
    from tests.firmware.bench import Core

RING_BYTES = 1024
MOVES = st.lists(st.tuples(st.booleans(), st.integers(0, 700)), max_size=40)


def put(core: Core, ring: Any, data: bytes) -> bool:
    return bool(core.lib.ring_put(ring, data, len(data)))


def take(core: Core, ring: Any, room: int) -> bytes:
    out = core.new("uint8_t[]", max(room, 1))
    return bytes(out[0 : core.lib.ring_take(ring, out, room)])


@pytest.mark.parametrize("start", [0, 2**32 - 500], ids=["new", "before the wrap"])
def test_ring_keeps_order_and_loses_nothing(core: Core, start: int) -> None:
    @given(MOVES)
    def check(moves: list[tuple[bool, int]]) -> None:
        ring = core.new("struct ring *")
        ring.written = ring.read = start
        held: deque[int] = deque()
        number = 0
        for puts, length in moves:
            assert core.lib.ring_room(ring) == RING_BYTES - len(held)
            assert core.lib.ring_is_empty(ring) is not bool(held)
            if puts:
                data = bytes((number + i) % 251 for i in range(length))
                fits = length <= RING_BYTES - len(held)
                assert put(core, ring, data) is fits
                held.extend(data if fits else b"")
                number += length
            else:
                expected = bytes(held.popleft() for _ in range(min(length, len(held))))
                assert take(core, ring, length) == expected

    check()


@pytest.mark.parametrize("start", [0, 2**32 - 1])
def test_ring_filled_to_its_last_byte_keeps_its_oldest(core: Core, start: int) -> None:
    ring = core.new("struct ring *")
    ring.written = ring.read = start
    oldest, rest = bytes(range(1, 101)), bytes(200 for _ in range(RING_BYTES - 100))
    assert put(core, ring, oldest)
    beyond = rest + b"\x99"  # the byte behind those to put stands where a byte too many would come from
    assert core.lib.ring_put(ring, beyond, len(rest))
    assert core.lib.ring_room(ring) == 0
    assert not put(core, ring, b"\x01")
    assert take(core, ring, RING_BYTES + 1) == oldest + rest
