"""The registry of boards: a folder with a board.h is built, analysed, documented; wrong data are refused."""

from __future__ import annotations

import re
import subprocess
from typing import TYPE_CHECKING

import pytest

from tests.target.build import FIRMWARE, build, needed
from tests.target.rung import BOARDS, RELEASED, rung, sine
from tests.target.static import PROGRAMS
from tools import artefact
from tools.boards import FOLDER, ON_A_PC, PROTOCOL, README, read_boards

if TYPE_CHECKING:
    from pathlib import Path

_OTHER = {
    "BOARD_NUMBER 3": "BOARD_NUMBER 99",
    "BOARD_CRYSTAL_HZ 8000000u": "BOARD_CRYSTAL_HZ 12000000u",
    "BOARD_FLASH_KIB 1024u": "BOARD_FLASH_KIB 512u",
    "BOARD_ENABLE PB15": "BOARD_ENABLE PC4",
    "BOARD_ENCODER_B PA1": "BOARD_ENCODER_B PB3",
    "BOARD_SERIAL_TX PA9": "BOARD_SERIAL_TX PB6",
    "BOARD_CAN_RX PB8": "BOARD_CAN_RX PA11",
    "BOARD_CAN_TX PB9": "BOARD_CAN_TX PA12",
}
"""A board that shares as little as possible with the first one."""


def write_board(folder: Path, changes: dict[str, str], name: str = "other") -> Path:
    """Write a board like bench_f405_dac with some lines changed; return its folder."""
    text = (FOLDER / "bench_f405_dac/board.h").read_text("utf-8")
    for line, other in changes.items():
        assert line in text
        text = text.replace(line, other)
    (folder / name).mkdir()
    (folder / name / "board.h").write_text(text, "utf-8")
    return folder / name


def check(*folders: Path) -> subprocess.CompletedProcess[str]:
    """Let CMake check the data of boards."""
    command = [needed("cmake"), f"-DFOLDERS={';'.join(map(str, folders))}", "-P", "cmake/boards.cmake"]
    return subprocess.run(command, cwd=FIRMWARE, capture_output=True, text=True, check=False)


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
    write_board(boards, _OTHER)
    _, said = build(built, "f405", f"-DDCMP_BOARDS={boards}")
    assert re.search(r"CODE: +\d+ B +464 KB", said)  # 512 without what is the record's
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


# --------------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("line", "other", "said"),
    [
        (
            "BOARD_CAN_RX PB8",
            "BOARD_CAN_RX PC4",
            "BOARD_CAN_RX is PC4, which has no such function. Choose one of PA11, PB8, PD0",
        ),
        (
            "BOARD_ENABLE PB15",
            "BOARD_ENABLE PB8",
            "BOARD_ENABLE and BOARD_CAN_RX are both PB8. Choose another pin for one of them",
        ),
        (
            "BOARD_ENABLE PB15",
            "BOARD_ENABLE PA13",
            "BOARD_ENABLE is PA13, a pin of the debug probe. Choose another pin",
        ),
        *(
            (
                "BOARD_ENABLE PB15",
                f"BOARD_ENABLE {pin}",
                f"BOARD_ENABLE is {pin}, which may be high in a reset or while firmware is loaded",
            )
            for pin in ("PA15", "PB4", "PB10")
        ),
        ("BOARD_ENABLE PB15", "BOARD_ENABLE PB16", "BOARD_ENABLE is PB16. Write a pin from PA0 to PG15"),
        ("BOARD_ENABLE PB15", "BOARD_ENABLE", "BOARD_ENABLE is . Write a pin from PA0 to PG15"),
        (
            "BOARD_CRYSTAL_HZ 8000000u",
            "BOARD_CRYSTAL_HZ 48000000u",
            "BOARD_CRYSTAL_HZ is 48000000. Write a number from 4000000 to 26000000",
        ),
        (
            "BOARD_CRYSTAL_HZ 8000000u",
            "BOARD_CRYSTAL_HZ 11059200u",
            "The PLL needs a multiple of 2000000: another crystal",
        ),
        (
            "BOARD_FLASH_KIB 1024u",
            "BOARD_FLASH_KIB 2048u",
            "BOARD_FLASH_KIB is 2048. Write a number from 128 to 1024",
        ),
        ("BOARD_RAM_KIB 128u", "BOARD_RAM_KIB 192u", "BOARD_RAM_KIB is 192. Write a number from 16 to 128"),
        (
            "BOARD_NUMBER 3",
            "BOARD_NUMBER 5",
            "BOARD_NUMBER 5 is another board's. The numbers 1, 2, 5 are taken: choose one that is free",
        ),
        ("BOARD_NUMBER 3", "BOARD_NUMBER 2", "BOARD_NUMBER 2 is another board's"),
        ("BOARD_NUMBER 3", "BOARD_NUMBER 0x63", "BOARD_NUMBER is 0x63. Write a number from 1 to 255"),
        ("#define BOARD_CAN_TX PB9\n", "", "there is no BOARD_CAN_TX. Write `#define BOARD_CAN_TX ...`"),
        (
            "#define BOARD_DAC PA4\n",
            "",
            "the amplifier is not known. Write either BOARD_DAC, or BOARD_PWM with",
        ),
        ("BOARD_DAC PA4\n", "BOARD_DAC PA4\n#define BOARD_PWM PA8\n", "the amplifier is not known"),
        (
            "BOARD_DAC PA4\n",
            "BOARD_DAC PA4\n#define BOARD_LED PC13\n",
            "BOARD_LED has no meaning on this board. Remove it",
        ),
        (
            "BOARD_DAC PA4\n",
            "BOARD_DAC PA4\n#define BOARD_DAC PA4\n",
            "BOARD_DAC is there twice. Leave one of them",
        ),
        (
            "BOARD_DAC PA4\n",
            "BOARD_DAC (PA4)\n",
            "Write `#define BOARD_KEY VALUE`, a number or a pin such as PB15",
        ),
    ],
)
def test_wrong_data_are_refused_with_a_remedy(tmp_path: Path, line: str, other: str, said: str) -> None:
    wrong = write_board(tmp_path, {line: other})
    done = check(FOLDER / "bench_f405_pwm", wrong)
    assert done.returncode != 0
    assert said in " ".join(done.stderr.split())
    assert "other/board.h" in done.stderr.replace("\n", "").replace(" ", "")
