"""What stands for a board's program where nothing is built."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from tools import manifest
from tools.boards import FOLDER

if TYPE_CHECKING:
    from pathlib import Path

DAC = "bench_f405_dac"


def write_images(folder: Path, board: str = DAC, data: Path = FOLDER / DAC / "board.h") -> None:
    """Write what stands for the images of a board that was built of a board.h, and their manifest."""
    images = [folder / f"{board}.{piece}.bin" for piece in ("code", "vectors")]
    for image_of in images:
        image_of.write_bytes(image_of.name.encode())
    known = {"boards": {board: manifest.entry(data, images, {})}}
    (folder / manifest.NAME).write_text(json.dumps(known))


def write_own_board(folder: Path, name: str = "mine") -> Path:
    """Write a board of one's own; return its board.h."""
    text = (FOLDER / DAC / "board.h").read_text("utf-8")
    (folder / name).mkdir(parents=True)
    (folder / name / "board.h").write_text(text.replace("BOARD_NUMBER 3", "BOARD_NUMBER 199"), "utf-8")
    return folder / name / "board.h"
