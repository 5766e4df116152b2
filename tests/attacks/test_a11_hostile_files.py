"""A11. Who attacks: the author of a recording, of a rig file or of a CSV file that somebody else opens.

What is promised: every file is answered by a sentence and a documented exit code, with at most 500 MB of
memory and in seconds; no control character of a file reaches the terminal as it is.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.typed_text import printable
from tests.attacks.hostile.recordings import ESCAPE, recordings
from tests.installed import environment

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.installed import Finished

    Script = Callable[..., Finished]

_MOST_MB = 500
_MOST_CPU = 20.0  # s: of a file that is made to take long
_LONGEST = 30_000  # characters printed
_FEWEST = 35
_CONTROL = [chr(code) for code in (*range(0x20), 0x7F, *range(0x80, 0xA0), 0x202E) if chr(code) not in "\n\t"]
_CSV = {
    "nothing": b"",
    "a NUL": b"time_s,position_rad,torque_Nm\n0,0,0\n0.1,\0,0\n",
    "one long line": b"time_s," + b"x" * 5_000_000,
    "a million columns": b",".join(b"c%d" % k for k in range(300_000)) + b"\n",
    "escapes in the header": f"time_s,position_rad,torque_Nm,{ESCAPE}\n".encode() + b"0,0,0,0\n" * 20,
    "escapes in a field": b"time_s,position_rad,torque_Nm\n" + f"0,{ESCAPE},0\n".encode() * 20,
    "an open quote": b'time_s,position_rad,torque_Nm\n0,"' + b"0,\n" * 100_000,
    "numbers beyond all": b"time_s,position_rad,torque_Nm\n" + b"1e999,1e999,-1e999\n" * 50,
    "huge numbers": b"time_s,position_rad,torque_Nm\n" + b"".join(b"%d,1e308,1e308\n" % k for k in range(50)),
    "long digits": b"time_s,position_rad,torque_Nm\n" + b"9" * 100_000 + b",0,0\n",
    "time that runs backwards": b"time_s,position_rad,torque_Nm\n"
    + b"".join(b"%d,0,0\n" % -k for k in range(60)),
    "bytes of no encoding": bytes(range(256)) * 4000,
    "nothing but commas": b"," * 2_000_000,
    "nothing but ends of lines": b"\n" * 2_000_000,
}
_TOML_ESCAPE = json.dumps(ESCAPE)
_RIGS = {
    "nothing": b"",
    "deep brackets": b"a = " + b"[" * 100_000,
    "deep tables": b"[" + b".".join([b"a"] * 50_000) + b"]\n",
    "a long key": b"k" * 900_000 + b" = 1\n",
    "a huge number": b"[loop]\nrate_hz = 1" + b"0" * 100_000 + b"\n",
    "escapes": f"name = {_TOML_ESCAPE}\n[{_TOML_ESCAPE}]\n".encode(),
    "raw escapes": f'name = "{ESCAPE}"\n'.encode(),
    "bytes of no encoding": b'name = "\xff\xfe"\n',
    "a file of 2 MB": b"# " + b"x" * 2_000_000,
    "numbers that are none": b"[loop]\nrate_hz = nan\n[model]\nku_rad_s2_V = inf\ngravity_rad_s2 = -inf\n",
    "numbers beyond all": b"[loop]\nrate_hz = 1e308\n[encoder]\ncounts_per_rev = 1e300\n",
    "many keys": b"".join(b"k%d = 1\n" % k for k in range(50_000)),
    "a class that is none": b'[controller]\nkind = "os:getcwd"\n[controller.options]\nx = 1\n',
}


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
            and one["long"] < _LONGEST
            and one["cpu"] < _MOST_CPU
            and one["MB"] < _MOST_MB
        )
        if not sound:
            wrong.append({**one, "printed": printed[-500:]})
    assert wrong == []


def test_every_hostile_recording_is_a_sentence(tmp_path: Path) -> None:
    files = recordings()
    assert len(files) > _FEWEST
    found = _read_all(tmp_path / "files", "mcap", files)
    assert len(found) == 2 * len(files)
    _judge(found, {0, 2, 6})
    codes = {(one["file"], one["command"]): one["code"] for one in found}
    assert codes["bomb of zeros", "export"] == 6
    assert codes["deep rig", "replay"] == 2
    assert codes["a record of 2**64", "replay"] == 6
    assert not (tmp_path / "files" / "was_here").exists()


def test_every_hostile_csv_is_a_sentence(tmp_path: Path) -> None:
    _judge(_read_all(tmp_path / "files", "csv", _CSV), {0, 2})


def test_every_hostile_rig_is_a_sentence(tmp_path: Path) -> None:
    _judge(_read_all(tmp_path / "files", "toml", _RIGS), {0, 2})
    assert not (tmp_path / "files" / "was_here").exists()


@pytest.mark.parametrize("what", ["pipe", "folder", "device", "circle", "hole"])
def test_what_is_no_file_is_said_to_be_none(script: Script, tmp_path: Path, what: str) -> None:
    place = tmp_path / "it.mcap"
    if what == "pipe":
        os.mkfifo(place)
    elif what == "folder":
        place.mkdir()
    elif what == "device":
        place.symlink_to("/dev/zero")
    elif what == "circle":
        place.symlink_to(place)
    else:
        with place.open("wb") as file:
            file.truncate(300 << 20)
    done = script("export", "it.mcap", "--csv", "out.csv", cwd=tmp_path)
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error: it.mcap")
    assert done.err.count("\n") == 1
    assert not (tmp_path / "out.csv").exists()


def test_escapes_of_a_file_are_shown_and_not_carried_out(script: Script, tmp_path: Path) -> None:
    (tmp_path / "it.mcap").write_bytes(recordings()["run of escapes"])
    done = script("replay", "it.mcap", cwd=tmp_path)
    assert done.code == 2
    assert not any(character in done.err for character in _CONTROL)
    assert "␛]0;owned" in done.err
    assert not any(character in printable(ESCAPE) for character in _CONTROL)
    assert printable("µ: 2 rad/s²\n\tend") == "µ: 2 rad/s²\n\tend"
