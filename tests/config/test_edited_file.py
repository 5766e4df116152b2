"""Writing an edited rig file: beside other writers, and nothing left behind."""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.config.edited_file import propose
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable

_TEXT = "[model]\nf1_rad_s2 = 1.3 # c\n"


def _rig(folder: Path) -> Path:
    path = folder / "mine.toml"
    path.write_text(_TEXT, encoding="utf-8")
    return path


def test_of_two_that_write_at_once_one_is_told(tmp_path: Path) -> None:
    path = _rig(tmp_path)
    proposal = propose(path, ["model.f1_rad_s2=1.5"])
    with path.open("rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(ConfigError, match=r"another program is writing it\. Nothing is written"):
            proposal.write()
    assert path.read_text(encoding="utf-8") == _TEXT
    proposal.write()
    assert path.read_text(encoding="utf-8") == _TEXT.replace("1.3", "1.5")


def test_where_a_file_cannot_be_locked_it_is_written_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    path = _rig(tmp_path)
    propose(path, ["model.f1_rad_s2=1.5"]).write()
    assert path.read_text(encoding="utf-8") == _TEXT.replace("1.3", "1.5")


def test_a_write_that_fails_leaves_the_file_and_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _rig(tmp_path)
    proposal = propose(path, ["model.f1_rad_s2=1.5"])
    whole: Callable[[Path, bytes], int] = Path.write_bytes

    def half(place: Path, data: bytes) -> int:
        whole(place, data[: len(data) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(ConfigError, match=r"No space left on device\. Nothing is written"):
        proposal.write()
    assert path.read_text(encoding="utf-8") == _TEXT
    assert list(tmp_path.iterdir()) == [path]
