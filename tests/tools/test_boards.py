"""What pages say of the boards is what their board.h says."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from tools import boards
from tools.artefact import FIRMWARE
from tools.boards import FOLDER, PROTOCOL, README, files, read_boards, released

if TYPE_CHECKING:
    from pathlib import Path


def test_pages_say_what_the_boards_are() -> None:
    made = files()
    assert set(made) == {PROTOCOL, README}
    for path, text in made.items():
        assert path.read_text("utf-8") == text, f"{path}: python -m tools.boards"


def test_board_that_is_there_is_on_the_pages_and_released(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (FOLDER / "bench_f405_dac/board.h").read_text("utf-8")
    (tmp_path / "other").mkdir()
    (tmp_path / "other/board.h").write_text(
        text.replace("NUMBER 3", "NUMBER 199").replace("PB15", "PC4"), "utf-8"
    )
    assert released(read_boards(tmp_path)) == ["other"]
    made = files(tmp_path)
    assert "| 199 | other |" in made[PROTOCOL]
    assert re.search(r"ENABLE, .* \| PC4 \|$", made[README], re.MULTILINE)
    monkeypatch.setattr(boards, "files", lambda: made)
    monkeypatch.setattr("sys.argv", ["boards", "--check"])
    with pytest.raises(SystemExit, match="True"):
        boards.main()
    assert "docs/protocol.md is not what the boards say: python -m tools.boards" in capsys.readouterr().out


def test_every_pin_that_a_board_may_have_is_a_row() -> None:
    text = (FIRMWARE / "cmake/boards.cmake").read_text("utf-8")
    keys = re.findall(r"^set\((?:BENCH|DAC|PWM)_PINS ([A-Z_ ]+)\)", text, re.MULTILINE)
    assert sorted(" ".join(keys).split()) == sorted(boards.PIN_MEANINGS)


def test_what_is_in_a_comment_is_not_data(tmp_path: Path) -> None:
    text = (FOLDER / "bench_f405_dac/board.h").read_text("utf-8")
    (tmp_path / "other").mkdir()
    (tmp_path / "other/board.h").write_text(
        text.replace("#define BOARD_DAC PA4\n", "/* as on the other board:\n#define BOARD_PWM PA8\n*/\n"),
        "utf-8",
    )
    assert read_boards(tmp_path)["other"].amplifier is None


@pytest.mark.parametrize("line", ["#define BOARD_NUMBER 3\n", "#define BOARD_CRYSTAL_HZ 8000000u\n"])
def test_file_without_a_number_is_no_board(tmp_path: Path, line: str) -> None:
    text = (FOLDER / "bench_f405_dac/board.h").read_text("utf-8")
    (tmp_path / "other").mkdir()
    (tmp_path / "other/board.h").write_text(text.replace(line, ""), "utf-8")
    with pytest.raises(ValueError, match=r"other/board\.h: '(NUMBER|CRYSTAL_HZ)'\. Build the firmware"):
        read_boards(tmp_path)
