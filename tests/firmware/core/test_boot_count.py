"""The number of a boot: it rises at every boot, with any loss of memory, and few resets cost a record."""

from __future__ import annotations

import random
from typing import Any

import pytest
from fastcrc import crc16
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.firmware.bench import CONFIG, Core
from tools.record import record

AHEAD_MAX = 4095
INT_MAX = 2**31 - 1
MEMORY_BYTES, CHECK_AT = 16, 12


class Board:
    """Flash memory, and memory that a reset leaves alone."""

    def __init__(self, core: Core, boot_count: int = 0, sequence: int = 1) -> None:
        self.core, self.lib = core, core.lib
        self.memory = core.new("struct boot_memory *")
        self.flashed = core.new("struct record *")
        self.written = 0
        self.lose_memory(1)
        self.flash(boot_count, sequence)

    def flash(self, boot_count: int, sequence: int) -> None:
        made = record(CONFIG, boot_count=boot_count, sequence=sequence)
        self.core.ffi.buffer(self.flashed)[:] = made

    def lose_memory(self, seed: int) -> None:
        self.core.ffi.buffer(self.memory)[:] = random.Random(seed).randbytes(MEMORY_BYTES)

    def next(self) -> Any:
        return self.lib.boot_next(self.memory, self.flashed)

    def boot(self, *, cut: str = "") -> int | None:
        """Return the number that is told; None where power goes before that."""
        boot = self.next()
        if boot.reserved != self.flashed.boot_count:
            if cut == "before the record":
                return None
            self.flash(boot.reserved, self.flashed.sequence + 1)
            self.written += 1
            if cut == "behind the record":
                return None
        self.lib.boot_remember(self.memory, self.core.new("struct boot *", boot), self.flashed.sequence)
        return int(boot.count)

    @property
    def content(self) -> bytearray:
        return bytearray(self.core.ffi.buffer(self.memory))

    @content.setter
    def content(self, data: bytes | bytearray) -> None:
        self.core.ffi.buffer(self.memory)[:] = bytes(data)

    def forge(self, sequence: int, first: int, count: int) -> None:
        """Have memory whose checksum is right."""
        body = b"".join((value & 0xFFFF_FFFF).to_bytes(4, "little") for value in (sequence, first, count))
        self.content = body + (0xB007_0000 | crc16.ibm_3740(body)).to_bytes(4, "little")


def test_memory_is_laid_out_as_the_checksum_takes_it(core: Core) -> None:
    board = Board(core, boot_count=41)
    assert board.boot() == 42
    data = board.content
    assert len(data) == MEMORY_BYTES
    expected = [2, 42, 42, 0xB007_0000 | crc16.ibm_3740(bytes(data[:CHECK_AT]))]
    assert [int.from_bytes(data[at : at + 4], "little") for at in range(0, MEMORY_BYTES, 4)] == expected


def test_power_cycle_costs_one_record_and_one_number(core: Core) -> None:
    board = Board(core)
    for power_cycle in range(1, 50):
        board.lose_memory(power_cycle)
        assert board.boot() == power_cycle
    assert (board.written, board.flashed.boot_count) == (49, 49)


def test_restart_loop_costs_few_records(core: Core) -> None:
    board = Board(core)
    written_at = []
    for resets in range(20_000):
        before = board.written
        assert board.boot() == 1 + resets
        if board.written > before:
            written_at.append(resets)
            assert board.flashed.boot_count == 1 + resets + min(resets, AHEAD_MAX)
    assert written_at == [2**n - 1 for n in range(13)] + [8191, 12_287, 16_383]


CUTS = ("", "before the record", "behind the record")
STEPS = st.lists(
    st.tuples(
        st.sampled_from(("reset", "reset", "reset", "power", "bit")),
        st.integers(0, 127),
        st.sampled_from(CUTS),
    ),
    max_size=80,
)


@settings(max_examples=100, deadline=None)
@given(steps=STEPS, flashed=st.integers(0, 5))
def test_numbers_rise_with_every_loss(core: Core, steps: list[tuple[str, int, str]], flashed: int) -> None:
    board = Board(core, boot_count=flashed)
    told, attempts, losses = [flashed], 0, 1
    for kind, at, cut in steps:
        if kind == "power":
            board.lose_memory(at)
        elif kind == "bit":
            data = board.content
            data[at // 8] ^= 1 << at % 8
            board.content = data
        count = board.boot(cut=cut)
        attempts += 1
        losses += kind != "reset" or count is None
        if count is not None:
            assert count > told[-1]
            told.append(count)
    assert told[-1] <= flashed + 2 * attempts
    assert board.flashed.boot_count >= told[-1]
    assert board.written <= losses * (1 + max(attempts, 1).bit_length())


@pytest.mark.parametrize("bit", range(8 * MEMORY_BYTES))
def test_damaged_memory_is_lost_memory(core: Core, bit: int) -> None:
    board = Board(core)
    for _ in range(4):
        board.boot()
    assert (board.next().count, board.flashed.boot_count) == (5, 7)
    data = board.content
    data[bit // 8] ^= 1 << bit % 8
    board.content = data
    found = board.next()
    assert (found.count, found.first, found.reserved) == (8, 8, 8)


@pytest.mark.parametrize(
    ("first", "count", "kept"),
    [
        (1, 5000, True),
        (1, 4999, True),
        (5000, 5000, True),
        (1, 5000 - AHEAD_MAX, True),
        (1, 5000 - AHEAD_MAX - 1, False),
        (1, 5001, False),
        (4501, 4500, False),
        (0, 4500, False),
        (-1, 4500, False),
        (-(2**31), 4500, False),
        (-5, -5, False),
        (1, INT_MAX, False),
    ],
)
def test_garbage_with_a_good_checksum_is_bounded_by_the_record(
    core: Core, first: int, count: int, kept: bool
) -> None:
    board = Board(core, boot_count=5000, sequence=9)
    board.forge(9, first, count)
    assert board.next().count == (count + 1 if kept else 5001)
    assert 5001 - AHEAD_MAX <= board.next().count <= 5001
    board.forge(8, first, count)
    assert board.next().count == 5001


def test_board_that_is_flashed_anew_begins_anew(core: Core) -> None:
    """Its memory goes with another record."""
    board = Board(core)
    for _ in range(3):
        board.boot()
    board.flash(0, 1)
    assert board.boot() == 1


@pytest.mark.parametrize(
    ("recorded", "count"),
    [
        (-1, 0),
        (-(2**31), 0),
        (INT_MAX, 0),
        (INT_MAX - AHEAD_MAX, 0),
        (INT_MAX - AHEAD_MAX - 1, INT_MAX - AHEAD_MAX),
    ],
)
def test_record_that_leaves_no_numbers_is_not_counted_on(core: Core, recorded: int, count: int) -> None:
    board = Board(core, boot_count=recorded)
    found = board.next()
    assert (found.count, found.first) == (count, count)
    assert found.reserved == (count or recorded)
    board.boot()
    assert board.written == (1 if count else 0)
    assert board.next().count == 0
