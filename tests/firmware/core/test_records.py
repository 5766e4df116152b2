"""What a board keeps of itself: the newest whole record counts, and power may go at any word of the next."""

from __future__ import annotations

from typing import Any

import pytest
from fastcrc import crc16

from tests.firmware.bench import CONFIG, Core
from tools.record import RECORD_BYTES, RecordLink, record

PLACE_COUNT = 204
BLANK = b"\xff" * RECORD_BYTES


class Store:
    """Two flash sectors, as the firmware sees them."""

    def __init__(self, core: Core, *sectors: list[bytes]) -> None:
        self.core = core
        self.places = max(map(len, sectors))
        self._kept = [core.new("struct record[]", self.places) for _ in range(2)]
        self.sectors = core.new("struct record *[]", self._kept)
        for kept, content in zip(self._kept, sectors, strict=True):
            buffer = core.ffi.buffer(kept)
            buffer[:] = b"".join(content).ljust(len(buffer), b"\xff")

    def newest(self) -> Any:
        """Return a copy: the sectors may be gone before it is looked at."""
        found = self._newest()
        return self.core.new("struct record *", found[0]) if found else found

    def _newest(self) -> Any:
        return self.core.lib.record_newest(self.sectors, self.places)

    def next(self) -> tuple[int, int, bool]:
        place = self.core.lib.record_next(self.sectors, self.places, self._newest())
        return place.sector, place.index, place.blank_first


def numbered(sequence: int) -> bytes:
    return record(CONFIG, sequence=sequence, boot_count=sequence)


def test_python_and_firmware_mean_the_same_record(core: Core) -> None:
    written = record(
        {**CONFIG, "node": 5, "slew_mV_per_ms": -3}, link=RecordLink.can, baud=500_000, zero_code=2051,
        full_scale_mV=12_345, boot_count=41, sequence=7,
    )  # fmt: skip
    assert core.ffi.sizeof("struct record") == RECORD_BYTES == 80
    found = Store(core, [written], []).newest()
    assert (found.sequence, found.boot_count, found.node, found.link) == (7, 41, 5, RecordLink.can)
    assert (found.counts_per_rev, found.period_us, found.voltage_limit_mV) == (4096, 1000, 10_000)
    assert (found.slew_mV_per_ms, found.watchdog_ms, found.speed_limit_counts_s) == (-3, 20, 40_000)
    assert (found.travel_limit_counts, found.baud, found.zero_code, found.full_scale_mV) == (
        20_000, 500_000, 2051, 12_345,
    )  # fmt: skip
    again = core.new("struct record *", found[0])
    again.magic = again.crc = 0
    core.lib.record_seal(again)
    assert bytes(core.ffi.buffer(again)) == written


def test_nothing_written_is_no_record(core: Core) -> None:
    empty = Store(core, [BLANK] * 3, [BLANK] * 3)
    assert empty.newest() == core.ffi.NULL
    assert empty.next() == (0, 0, False)


def test_garbage_is_no_record_and_is_blanked(core: Core) -> None:
    garbage = Store(core, [b"\0" * RECORD_BYTES] * 3, [numbered(1)[:-3] + b"\x01\0\0"] * 3)
    assert garbage.newest() == core.ffi.NULL
    assert garbage.next() == (0, 0, True)


def test_records_go_round_both_sectors(core: Core) -> None:
    places = 3
    sectors: list[list[bytes]] = [[BLANK] * places, [BLANK] * places]
    seen = []
    for sequence in range(1, 12):
        store = Store(core, *sectors)
        sector, index, blank_first = store.next()
        seen.append((sector, index, blank_first))
        if blank_first:
            sectors[sector] = [BLANK] * places
        assert sectors[sector][index] == BLANK
        sectors[sector][index] = numbered(sequence)
        assert Store(core, *sectors).newest().boot_count == sequence
    assert seen[:7] == [
        (0, 0, False), (0, 1, False), (0, 2, False), (1, 0, True), (1, 1, False), (1, 2, False), (0, 0, True),
    ]  # fmt: skip


@pytest.mark.parametrize("words", range(RECORD_BYTES // 4))
def test_power_that_goes_in_a_write_leaves_the_record_before(core: Core, words: int) -> None:
    half = numbered(2)[: 4 * words].ljust(RECORD_BYTES, b"\xff")
    store = Store(core, [numbered(1), half, BLANK], [BLANK] * 3)
    assert store.newest().boot_count == 1
    assert store.next() == (0, 2 if words else 1, False)


def test_sector_that_was_half_blanked_is_blanked_again(core: Core) -> None:
    full = [numbered(n) for n in (4, 5, 6)]
    torn = [BLANK, b"\xff" * 40 + numbered(2)[40:], BLANK]
    store = Store(core, full, torn)
    assert store.newest().boot_count == 6
    assert store.next() == (1, 0, True)


def test_full_flash_of_the_board_holds_so_many(core: Core) -> None:
    assert 16 * 1024 // RECORD_BYTES == PLACE_COUNT
    sectors = [[numbered(n) for n in range(1, PLACE_COUNT + 1)], [BLANK] * PLACE_COUNT]
    assert Store(core, *sectors).next() == (1, 0, True)


def test_magic_is_looked_at_too(core: Core) -> None:
    body = b"\0" + numbered(1)[1:-4]
    other = body + crc16.ibm_3740(body).to_bytes(4, "little")
    assert Store(core, [other], []).newest() == core.ffi.NULL


@pytest.mark.parametrize("word", range(RECORD_BYTES // 4))
def test_one_word_makes_a_place_used(core: Core, word: int) -> None:
    torn = BLANK[: 4 * word] + bytes(4) + BLANK[4 * word + 4 :]
    assert Store(core, [numbered(1), torn, BLANK], []).next() == (0, 2, False)


def test_place_behind_a_sector_is_not_in_it(core: Core) -> None:
    """Sectors in any order in memory, one right behind the other."""
    memory = core.new("struct record[]", 4)
    core.ffi.buffer(memory)[:] = BLANK * 2 + numbered(1) + BLANK
    sectors = core.new("struct record *[]", [memory + 2, memory])
    place = core.lib.record_next(sectors, 2, core.lib.record_newest(sectors, 2))
    assert (place.sector, place.index, place.blank_first) == (0, 1, False)
