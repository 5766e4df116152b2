"""The option word: only the brown-out level ever changes, and no word leads to a chip that stays locked."""

from __future__ import annotations

import json
import random
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from tests.tools import fake_programmer
from tests.tools.board_images import DAC, write_images
from tools import flash
from tools.brown_out import OPTCR_ADDRESS, OptionError, check_written, level, planned, write_by_probe, writes

if TYPE_CHECKING:
    from pathlib import Path

FACTORY_WORD = 0x0FFF_AAED
BOR_LEV_BITS, COMMANDS, LOCKED = 0xC, 0x3, 0x1
RESERVED = 0xF000_0010
RDP_NONE, RDP_LOCKED = 0xAA, 0xCC


def protection(word: int) -> int:
    return word >> 8 & 0xFF


def judged(word: int) -> bool:
    """Try a word; whether it is written, and then only as it may be."""
    try:
        settings = planned(word)
    except OptionError:
        assert protection(word) != RDP_NONE or word & COMMANDS != LOCKED or word & RESERVED
        return False
    assert word & COMMANDS == LOCKED
    assert not word & RESERVED
    assert protection(word) == RDP_NONE
    if settings is None:
        assert word & BOR_LEV_BITS == 0
        return False
    for write in writes(settings):
        if write.address == OPTCR_ADDRESS:
            assert protection(write.value) == RDP_NONE
            assert (write.value ^ word) & ~(BOR_LEV_BITS | COMMANDS) & 0xFFFF_FFFF == 0
            assert write.value & BOR_LEV_BITS == 0
    return True


def test_no_word_changes_more_than_the_level_nor_locks_the_chip() -> None:
    """Every lower half, with upper halves at the ends, the factory's, and drawn ones."""
    draw = random.Random(1)
    written = 0
    for low in range(1 << 16):
        for high in (0x0FFF, draw.getrandbits(12), 0x1000 | draw.getrandbits(16)):
            written += judged(high << 16 | low)
    assert (
        written == 2 * 24
    )  # RDP, both commands and a reserved bit are as they must be, and the level is not 3


@pytest.mark.parametrize("high", [0x0000, 0x0FFF, 0x0800, 0x0001, 0x07FF, 0x0AAA])
def test_every_write_protection_is_left_as_it_is(high: int) -> None:
    assert sum(judged(high << 16 | RDP_NONE << 8 | low) for low in range(256)) == 24


@pytest.mark.parametrize("rest", [0x0FFF_00ED, 0x0000_0001, 0x0FFF_00E1])
def test_any_other_protection_is_refused(rest: int) -> None:
    for value in range(256):
        if value == RDP_NONE:
            planned(rest | value << 8)
            continue
        with pytest.raises(OptionError, match="Nothing was written") as told:
            planned(rest | value << 8)
        assert ("for ever" in str(told.value)) == (value == RDP_LOCKED)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        (0x0FFF_AAE0, "begun and not ended"),  # the probe went before the start: BOR is off after a reset
        (0x0FFF_AAE2, "begun and not ended"),
        (0x0FFF_AAE3, "begun and not ended"),
        (0xF123_AA15, "bits are set"),
        (0xAAAA_AAAD, "bits are set"),
        (0x0FFF_AAFD, "bits are set"),
    ],
)
def test_word_that_does_not_say_what_the_chip_does_is_refused(word: int, said: str) -> None:
    with pytest.raises(OptionError, match=said) as told:
        planned(word)
    assert "Nothing was written" in str(told.value)


def test_factory_word_becomes_level_3() -> None:
    assert planned(FACTORY_WORD) == 0x0FFF_AAE0
    assert [hex(write.value) for write in writes(0x0FFF_AAE0)] == [
        "0x8192a3b", "0x4c5d6e7f", "0xfffaae0", "0xfffaae2", "0xfffaae1",
    ]  # fmt: skip
    assert [level(FACTORY_WORD & ~BOR_LEV_BITS | bits << 2) for bits in (0b11, 0b10, 0b01, 0b00)] == [
        "off", "level 1", "level 2", "level 3",
    ]  # fmt: skip


def test_write_that_is_cut_short_never_shows_the_protection_that_is_for_ever() -> None:
    """The word is erased to ones; any of the bits that are zero in the end may be programmed by then."""
    zeros = [bit for bit in range(8) if not RDP_NONE >> bit & 1]
    seen = {0xFF & ~sum(1 << bit for i, bit in enumerate(zeros) if some >> i & 1) for some in range(16)}
    assert RDP_LOCKED not in seen
    assert RDP_NONE in seen


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
    write_images(folder)
    monkeypatch.setenv("PATH", f"{folder}:/bin:/usr/bin")
    words = [DAC, "bench-serial", "--firmware", str(folder), "--by", by, *options]
    monkeypatch.setattr("sys.argv", ["flash", *words])
    return flash.main()


ALL = ["0x8004000", "0x800c000", "0x8000000"]


@pytest.mark.parametrize("word", [FACTORY_WORD, 0x0FFE_AAE9, 0x0123_AA85])
def test_probe_sets_level_3_and_then_flashes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, word: int
) -> None:
    kept = fake_programmer.install(tmp_path, word)
    assert run(tmp_path, monkeypatch, "pyocd") == 0
    found = fake_programmer.chip(kept)
    assert found["started"] == [word & ~BOR_LEV_BITS & ~COMMANDS]
    assert found["optcr"] == word & ~BOR_LEV_BITS & ~COMMANDS | 1
    assert (found["halted"], found["flashed"]) == (False, ALL)


def test_chip_that_has_level_3_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = fake_programmer.install(tmp_path, 0x0FFF_AAE1)
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
        (FACTORY_WORD, {"halts": False}, "did not halt"),
        (FACTORY_WORD, {"short": True}, "1 bytes were read, expected 4"),
        (
            FACTORY_WORD,
            {"stubborn": True},
            "option word 0x0fffaaed after it was written, expected 0x0fffaae1",
        ),
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
    ("word", "warned"), [(FACTORY_WORD, "is off"), (0x0FFF_AAE9, "is level 1"), (0x0FFF_AAE1, "")]
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


@pytest.mark.parametrize("writes_done", range(1, 6))
def test_probe_that_is_pulled_out_is_told_and_the_next_call_trusts_no_register(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], writes_done: int
) -> None:
    """After the third of them the register says level 3, and the chip has it off."""
    kept = fake_programmer.install(tmp_path, FACTORY_WORD, dies=writes_done)
    assert run(tmp_path, monkeypatch, "pyocd", "--only", "brown-out") == 3
    assert "Switch the board's supply off and on" in capsys.readouterr().err
    kept.write_text(json.dumps(fake_programmer.chip(kept) | {"dies": 99}))
    again = run(tmp_path, monkeypatch, "pyocd", "--only", "brown-out")
    said, refused = capsys.readouterr()
    unlocked = 3 <= writes_done < 6
    assert again == (3 if unlocked else 0)
    assert ("begun and not ended" in refused) == unlocked
    if not unlocked:
        assert said.endswith("brown-out level: level 3 (it was off)\n")
        assert fake_programmer.chip(kept)["stored"] & BOR_LEV_BITS == 0


@pytest.mark.parametrize("only", ["record", "program"])
def test_option_word_is_only_looked_at_where_a_part_is_flashed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], only: str
) -> None:
    kept = fake_programmer.install(tmp_path, FACTORY_WORD)
    assert run(tmp_path, monkeypatch, "pyocd", "--only", only) == 0
    assert "brown-out level is off" in capsys.readouterr().err
    assert (fake_programmer.chip(kept)["started"], fake_programmer.chip(kept)["keys"]) == ([], 0)


@pytest.mark.parametrize(
    ("word", "code", "said"), [(FACTORY_WORD, 3, "is off"), (0x0FFF_AAE1, 0, ""), (0, 3, "is not known")]
)
def test_boot_loader_cannot_set_the_level_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], word: int, code: int,
    said: str,
) -> None:  # fmt: skip
    fake_programmer.install(tmp_path, word)
    assert run(tmp_path, monkeypatch, "stm32flash", "--only", "brown-out") == code
    assert said in capsys.readouterr().err
