"""Boards that a test writes, and CMake's check of their data."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING

from tests.target.build import FIRMWARE, needed
from tools.boards import FOLDER

if TYPE_CHECKING:
    from pathlib import Path


def write_board(folder: Path, changes: dict[str, str], name: str = "other") -> Path:
    """Write a board like bench_f405_dac, with the number 199 and some lines changed; return its folder."""
    text = (
        (FOLDER / "bench_f405_dac/board.h").read_text("utf-8").replace("BOARD_NUMBER 3", "BOARD_NUMBER 199")
    )
    for line, other in changes.items():
        assert line in text
        text = text.replace(line, other)
    (folder / name).mkdir()
    (folder / name / "board.h").write_text(text, "utf-8")
    return folder / name


PWM_PINS = {"ENABLE": "BOARD_ENABLE PB15", "DIRECTION": "BOARD_DIRECTION PB14", "BREAK": "BOARD_BREAK PB12"}


def write_pwm_board(folder: Path, changes: dict[str, str], name: str) -> Path:
    """Write a board like bench_f405_dac with a bridge for the DAC and some changes; return its folder."""
    lines = ("BOARD_PWM PA8", PWM_PINS["DIRECTION"], PWM_PINS["BREAK"])
    return write_board(folder, {"BOARD_DAC PA4": "\n#define ".join(lines), **changes}, name)


def check(*folders: Path, firmware: Path = FIRMWARE) -> subprocess.CompletedProcess[str]:
    """Let CMake check the data of boards."""
    command = [needed("cmake"), f"-DFOLDERS={';'.join(map(str, folders))}", "-P", "cmake/boards.cmake"]
    return subprocess.run(command, cwd=firmware, capture_output=True, text=True, check=False)


def said_by(done: subprocess.CompletedProcess[str]) -> str:
    """Return what was refused, without the ends of lines."""
    assert done.returncode != 0
    return " ".join(done.stderr.split())
