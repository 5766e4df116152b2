"""A11. Who attacks: the author of a recording that another person opens.

What is promised: every file is answered by a sentence and a documented exit code, with at most 500 MB of
memory and in seconds; no control character of a file reaches the terminal as it is.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil import load_rig
from dcmp_hil.common.printable_text import printable
from dcmp_hil.errors import ConfigError
from tests.attacks.hostile.recordings import ESCAPE, recordings
from tests.installed import environment

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.installed import Finished

    Script = Callable[..., Finished]

_MOST_MB = 500
_MOST_CPU = 20.0  # s: of a file that is made to take long
_OUTPUT_CHARS_MAX = 30_000  # characters printed
_CASES_MIN = 35
_CONTROL = [chr(code) for code in (*range(0x20), 0x7F, *range(0x80, 0xA0), 0x202E) if chr(code) not in "\n\t"]


def _read_all(folder: Path, suffix: str, files: dict[str, bytes]) -> list[dict[str, Any]]:
    """Let one process read every file of a folder by every command; return what came of each."""
    folder.mkdir()
    for name, content in files.items():
        (folder / f"{name}.{suffix}").write_bytes(content)
    done = subprocess.run(
        [sys.executable, "-m", "tests.attacks.hostile.reads", str(folder)],
        cwd=Path(__file__).parents[2], env={**environment(), "PYTHONPATH": "."},
        check=False, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return [json.loads(line) for line in done.stdout.splitlines()]


def _judge(found: list[dict[str, Any]], codes: set[int]) -> None:
    wrong = []
    for one in found:
        printed = one["printed"]
        sound = (
            one["code"] in codes
            and "Traceback" not in printed
            and "Warning:" not in printed
            and not any(character in printed for character in _CONTROL)
            and (one["code"] == 0 or "error: " in printed)
            and one["long"] < _OUTPUT_CHARS_MAX
            and one["cpu"] < _MOST_CPU
            and one["MB"] < _MOST_MB
        )
        if not sound:
            wrong.append({**one, "printed": printed[-500:]})
    assert wrong == []


def test_every_hostile_recording_is_a_sentence(tmp_path: Path) -> None:
    files = recordings()
    assert len(files) > _CASES_MIN
    found = _read_all(tmp_path / "files", "mcap", files)
    assert len(found) == 2 * len(files)
    _judge(found, {0, 2, 6})
    codes = {(one["file"], one["command"]): one["code"] for one in found}
    assert codes["bomb of zeros", "export"] == 6
    assert codes["deep rig", "replay"] == 2
    assert codes["a record of 2**64", "replay"] == 6
    assert not (tmp_path / "files" / "was_here").exists()


_RIGS = {
    "dotted key": "a." * 60_000 + "a=1\n",
    "dotted key below a megabyte": "a." * 400_000 + "a=1\n",
    "dotted keys in lines": ("a." * 2_000 + "a=1\n") * 30,
    "many keys": "".join(f"k{number}=1\n" for number in range(9_000)),
    "open brackets": "a=" + "[" * 100_000,
}
_TABLES = {
    "digits": "t,x,u\n" + "1" * 5_000_000 + ",2,3\n",
    "a long cell in each row": "t,x,u\n" + ("0." + "1" * 20_000 + ",2,3\n") * 100,
    "a wide header": ",".join(f"c{number}" for number in range(20_000)) + "\n" + "1," * 19_999 + "1\n",
    "names that are alike": "t,x,u" + "".join(f",pos{number} [rad]" for number in range(5_000)) + "\n",
    "commas": "t,x,u\n" + "," * 900_000 + "\n",
    "an open quote": 't,x,u\n"' + "a\n" * 200_000,
}


@pytest.mark.parametrize("name", _RIGS)
def test_hostile_rig_is_refused_in_seconds(name: str, tmp_path: Path) -> None:
    (tmp_path / "it.toml").write_text(_RIGS[name])
    began = time.process_time()
    with pytest.raises(ConfigError):
        load_rig(tmp_path / "it.toml")
    assert time.process_time() - began < _MOST_CPU  # the first one takes a minute without its bound


@pytest.mark.parametrize("name", _TABLES)
def test_hostile_table_is_a_short_sentence(name: str, script: Script, tmp_path: Path) -> None:
    (tmp_path / "it.csv").write_text(_TABLES[name])
    done = script("replay", "it.csv", cwd=tmp_path)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error: ")
    assert len(done.err) < 3_000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["it.csv"]


@pytest.mark.parametrize(
    "arguments",
    [
        ("replay", "/dev/zero"),
        ("replay", "it.csv"),
        ("check", "bench-1khz", "--set", "reference.kind=table", "--set", "reference.file=/dev/zero"),
        ("check", "/dev/zero"),
        ("export", "/dev/zero", "--csv", "out.csv"),
    ],
)
def test_file_without_an_end_is_refused(arguments: tuple[str, ...], script: Script, tmp_path: Path) -> None:
    (tmp_path / "it.csv").symlink_to("/dev/zero")
    done = script(*arguments, cwd=tmp_path)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error: ")
    assert "Traceback" not in done.err
    assert len(done.err) < 1_000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["it.csv"]


def test_escapes_of_a_file_are_shown_and_not_carried_out(script: Script, tmp_path: Path) -> None:
    (tmp_path / "it.mcap").write_bytes(recordings()["run of escapes"])
    done = script("replay", "it.mcap", cwd=tmp_path)
    assert done.code == 2
    assert not any(character in done.err for character in _CONTROL)
    assert "␛]0;owned" in done.err
    assert not any(character in printable(ESCAPE) for character in _CONTROL)
    assert printable("µ: 2 rad/s²\n\tend") == "µ: 2 rad/s²\n\tend"
