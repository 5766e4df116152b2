"""The record alone is written for a board whose data are right, though no image says so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.target.build import needed
from tests.tools.board_images import write_images, write_own_board
from tools import flash

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    ("line", "other", "said"),
    [
        ("BOARD_NUMBER 199", "BOARD_NUMBER 7", "BOARD_NUMBER is 7. Write a number from 128 to 2147483647."),
        ("ENABLE PB15", "ENABLE PB14", None),
    ],
)
def test_record_alone_is_written_for_a_board_whose_data_cmake_takes(
    line: str,
    other: str,
    said: str | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    needed("cmake")
    boards = tmp_path / "my boards"
    data = write_own_board(boards)
    write_images(tmp_path, "mine", data)
    data.write_text(data.read_text("utf-8").replace(line, other), "utf-8")
    folders = ("--boards", str(boards), "--firmware", str(tmp_path))
    words = ["mine", "bench-serial", "--only", "record", "--dry-run"]
    monkeypatch.setattr("sys.argv", ["flash", *folders, *words])
    code = flash.main()
    answer = capsys.readouterr().err
    if said is None:
        assert (code, answer) == (0, "")
    else:
        assert code == 2
        assert answer.startswith(f"error: {data}: {said}")
        assert len(answer.splitlines()) == 1
