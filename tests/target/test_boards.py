"""The registry of boards: a folder with a board.h is built, analysed, documented."""

from __future__ import annotations

import os
import re
import subprocess
from typing import TYPE_CHECKING

import pytest

from tests.target.board_files import check, write_board
from tests.target.build import FIRMWARE, needed
from tests.target.rung import BOARDS, RELEASED, rung, sine
from tests.target.static import PROGRAMS
from tools import artefact, manifest
from tools.boards import FOLDER, ON_A_PC, PROTOCOL, README, read_boards

if TYPE_CHECKING:
    from pathlib import Path

_OTHER = {
    "BOARD_NUMBER 199": "BOARD_NUMBER 2000000199",
    "BOARD_PACKAGE_PINS 64u": "BOARD_PACKAGE_PINS 100u",
    "BOARD_CRYSTAL_HZ 8000000u": "BOARD_CRYSTAL_HZ 12000000u",
    "BOARD_FLASH_KIB 1024u": "BOARD_FLASH_KIB 512u",
    "BOARD_ENABLE PB15": "BOARD_ENABLE PC4",
    "BOARD_ENCODER_B PA1": "BOARD_ENCODER_B PB3",
    "BOARD_SERIAL_TX PA9": "BOARD_SERIAL_TX PB6",
    "BOARD_CAN_RX PB8": "BOARD_CAN_RX PA11",
    "BOARD_CAN_TX PB9": "BOARD_CAN_TX PA12",
}
"""A board that shares as little as possible with the first one."""


# ------------------------------------------------------------------------------------------ the registry


def test_every_folder_with_a_board_is_built_and_no_other_program_is(f405: Path) -> None:
    assert (
        {file.stem for file in f405.glob("*.elf")}
        == set(BOARDS)
        == {file.parent.name for file in FOLDER.glob("*/board.h")}
    )


def test_every_board_has_a_number_of_its_own() -> None:
    numbers = [*ON_A_PC, *(board.number for board in BOARDS.values())]
    assert len(set(numbers)) == len(numbers)


def test_every_board_is_analysed() -> None:
    assert set(BOARDS) <= set(PROGRAMS)
    assert all(f"boards/{name}" in PROGRAMS[name].options for name in BOARDS)


@pytest.mark.parametrize("name", BOARDS)
def test_every_board_is_in_the_documents(name: str) -> None:
    assert f"| {BOARDS[name].number} | {name} |" in PROTOCOL.read_text("utf-8")
    assert f"`{name}`" in README.read_text("utf-8") or name not in RELEASED


def test_cmake_and_python_read_the_same() -> None:
    done = check(*(FOLDER / name for name in BOARDS))
    assert done.stdout.splitlines() == [
        f"-- {board.name}: {board.number}, {board.amplifier or 'none'}" for board in BOARDS.values()
    ]


# ---------------------------------------------------------------------------------------- a board more


def test_board_is_one_file(tmp_path: Path) -> None:
    """A board with other pins, another crystal and less memory is its board.h: it is built, and controls."""
    boards, built = tmp_path / "boards", tmp_path / "built"
    boards.mkdir()
    data = write_board(boards, _OTHER) / "board.h"
    needed("arm-none-eabi-gcc")
    sizes = artefact.compile_boards(built, boards)
    assert set(sizes) == {"other"}
    memory = (built / "other.map").read_text()
    assert re.search(r"^CODE +0x0*800c000 +0x0*74000 ", memory, re.MULTILINE)  # 512 KiB less the record's
    known = artefact.release(built, tmp_path / "released", sizes, boards)["boards"]
    assert known["other"]["board_h_sha256"] == manifest.sha256(data)  # type: ignore[index]
    manifest.check_images(data, [tmp_path / f"released/other.{piece}" for piece in artefact.PIECES], "make")
    os.utime(data)
    with pytest.raises(RuntimeError, match=r"other/board\.h was changed while it was built\. Build it anew"):
        artefact.release(built, tmp_path / "released", sizes, boards)
    other = read_boards(boards)["other"]
    samples = {}
    for carrier in ("can", "cobs"):
        with rung(built, carrier, board=other) as target:
            samples[carrier] = target.drive(60, sine)
            assert target.system.enable
    assert max(abs(sample.voltage) for sample in samples["can"]) > 2.0
    # What is released is this project's boards, also where the folder was configured for others.
    assert set(artefact.compile_boards(built)) == set(BOARDS)


def test_folder_without_boards_is_refused(tmp_path: Path) -> None:
    configure = [
        needed("cmake"),
        "--preset",
        "f405",
        "-B",
        str(tmp_path / "built"),
        f"-DDCMP_BOARDS={tmp_path}",
    ]
    done = subprocess.run(configure, cwd=FIRMWARE, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "No board is in" in done.stderr
