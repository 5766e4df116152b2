"""The option word: only the brown-out level ever changes, and no word leads to a chip that stays locked."""

from __future__ import annotations

import random
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from tests.tools import fake_programmer
from tools import flash
from tools.brown_out import OPTCR, OptionError, check_written, level, planned, write_by_probe, writes

if TYPE_CHECKING:
    from pathlib import Path

FACTORY = 0x0FFF_AAED
BOR, COMMANDS = 0xC, 0x3
NONE, FOR_EVER = 0xAA, 0xCC


def protection(word: int) -> int:
    return word >> 8 & 0xFF


def judged(word: int) -> bool:
    """Try a word; whether it is written, and then only as it may be."""
    try:
        settings = planned(word)
    except OptionError:
        assert protection(word) != NONE
        return False
    assert protection(word) == NONE
    if settings is None:
        assert word & BOR == 0
        return False
    for write in writes(settings):
        if write.address == OPTCR:
            assert protection(write.value) == NONE
            assert (write.value ^ word) & ~(BOR | COMMANDS) & 0xFFFF_FFFF == 0
            assert write.value & BOR == 0
    return True


def test_no_word_changes_more_than_the_level_nor_locks_the_chip() -> None:
    """Every lower half, with upper halves at the ends, the factory's, and drawn ones."""
    draw = random.Random(1)
    written = 0
    for low in range(1 << 16):
        for high in (0x0FFF, draw.getrandbits(16)):
            written += judged(high << 16 | low)
    assert written == 2 * 256 * 3 // 4


@pytest.mark.parametrize("high", [0x0000, 0xFFFF, 0x8000, 0x0001, 0x7FFF, 0xF000])
def test_every_write_protection_is_left_as_it_is(high: int) -> None:
    assert sum(judged(high << 16 | NONE << 8 | low) for low in range(256)) == 192


@pytest.mark.parametrize("rest", [0x0FFF_00ED, 0xFFFF_00FF, 0, 0x0FFF_00E1])
def test_any_other_protection_is_refused(rest: int) -> None:
    for value in range(256):
        if value == NONE:
            planned(rest | value << 8)
            continue
        with pytest.raises(OptionError, match="Nothing was written") as told:
            planned(rest | value << 8)
        assert ("for ever" in str(told.value)) == (value == FOR_EVER)


def test_factory_word_becomes_level_3() -> None:
    assert planned(FACTORY) == 0x0FFF_AAE0
    assert [hex(write.value) for write in writes(0x0FFF_AAE0)] == [
        "0x8192a3b", "0x4c5d6e7f", "0xfffaae0", "0xfffaae2", "0xfffaae1",
    ]  # fmt: skip
    assert [level(FACTORY & ~BOR | bits << 2) for bits in (0b11, 0b10, 0b01, 0b00)] == [
        "off", "level 1", "level 2", "level 3",
    ]  # fmt: skip


def test_write_that_is_cut_short_never_shows_the_protection_that_is_for_ever() -> None:
    """The word is erased to ones; any of the bits that are zero in the end may be programmed by then."""
    zeros = [bit for bit in range(8) if not NONE >> bit & 1]
    seen = {0xFF & ~sum(1 << bit for i, bit in enumerate(zeros) if some >> i & 1) for some in range(16)}
    assert FOR_EVER not in seen
    assert NONE in seen


@pytest.mark.parametrize("bit", range(32))
def test_word_that_comes_back_wrong_is_told(bit: int) -> None:
    check_written(0x0FFF_AAE0, 0x0FFF_AAE1)
    if 1 << bit & COMMANDS:
        check_written(0x0FFF_AAE0, 0x0FFF_AAE0 ^ 1 << bit)
    else:
        with pytest.raises(OptionError, match=r"expected 0x0fffaae1\. Nothing else was written"):
            check_written(0x0FFF_AAE0, 0x0FFF_AAE1 ^ 1 << bit)


def test_command_holds_every_write_in_order() -> None:
    command = write_by_probe(0x0FFF_AAE0)
    assert [word for before, word in pairwise(command) if before == "-c"] == [
        "write32 0x40023c08 0x08192a3b", "write32 0x40023c08 0x4c5d6e7f", "write32 0x40023c14 0x0fffaae0",
        "write32 0x40023c14 0x0fffaae2", "sleep 2000", "write32 0x40023c14 0x0fffaae1", "reset",
    ]  # fmt: skip


# ------------------------------------------------------------------- tools.flash on a chip that is not there


def run(folder: Path, monkeypatch: pytest.MonkeyPatch, by: str, *options: str) -> int:
    for piece in ("code", "vectors"):
        (folder / f"bench_f405_dac.{piece}.bin").write_bytes(b"x")
    monkeypatch.setenv("PATH", f"{folder}:/bin:/usr/bin")
    words = ["bench_f405_dac", "bench-serial", "--firmware", str(folder), "--by", by, *options]
    monkeypatch.setattr("sys.argv", ["flash", *words])
    return flash.main()


ALL = ["0x8004000", "0x800c000", "0x8000000"]


@pytest.mark.parametrize("word", [FACTORY, 0x0FFE_AAE9, 0xF123_AA15])
def test_probe_sets_level_3_and_then_flashes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, word: int
) -> None:
    kept = fake_programmer.install(tmp_path, word)
    assert run(tmp_path, monkeypatch, "pyocd") == 0
    found = fake_programmer.chip(kept)
    assert found["started"] == [word & ~BOR & ~COMMANDS]
    assert found["optcr"] == word & ~BOR & ~COMMANDS | 1
    assert (found["halted"], found["flashed"]) == (False, ALL)


def test_chip_that_has_level_3_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = fake_programmer.install(tmp_path, 0x0FFF_AAE0)
    assert run(tmp_path, monkeypatch, "pyocd", "--only", "brown-out") == 0
    found = fake_programmer.chip(kept)
    assert (found["started"], found["keys"], found["flashed"]) == ([], 0, [])


@pytest.mark.parametrize(
    ("word", "chip", "said"),
    [
        (0x0FFF_55ED, {}, "RDP is 0x55, not 0xaa"),
        (0x0FFF_CCED, {}, "locked for ever"),
        (0xFFFF_FFFF, {}, "not read rightly"),
        (0, {}, "not read rightly"),
        (FACTORY, {"halts": False}, "did not halt"),
        (FACTORY, {"short": True}, "1 bytes were read, expected 4"),
        (FACTORY, {"stubborn": True}, "option word 0x0fffaaed after it was written, expected 0x0fffaae1"),
    ],
)
def test_refusal_writes_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], word: int,
    chip: dict[str, bool], said: str,
) -> None:  # fmt: skip
    kept = fake_programmer.install(tmp_path, word, **chip)
    assert run(tmp_path, monkeypatch, "pyocd") == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ")
    assert said in line
    found = fake_programmer.chip(kept)
    assert found["stored"] | 1 == word | 1
    assert found["flashed"] == []
    assert found["started"] == ([0x0FFF_AAE0] if "stubborn" in chip else [])


@pytest.mark.parametrize(
    ("word", "warned"), [(FACTORY, "is off"), (0x0FFF_AAE9, "is level 1"), (0x0FFF_AAE1, "")]
)
def test_boot_loader_looks_and_warns(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    word: int,
    warned: str,
) -> None:
    kept = fake_programmer.install(tmp_path, word)
    assert run(tmp_path, monkeypatch, "stm32flash") == 0
    told = capsys.readouterr().err
    assert warned in told
    assert bool(told) == bool(warned)
    found = fake_programmer.chip(kept)
    assert (found["stored"], found["flashed"]) == (word | 1, ALL)
