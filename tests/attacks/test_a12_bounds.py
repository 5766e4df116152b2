"""A12: inputs that never end, a cache that another user could write in, and a computer that is too busy.

Overrides are bounded before any work is done with them; a program is loaded only if this user wrote it and
it is whole; an error names the cause that this computer shows.
"""

from __future__ import annotations

import os
import subprocess
import time
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig
from dcmp_hil.device import open_errors
from dcmp_hil.errors import ConfigError, OpenError
from dcmp_hil.live.tunables import changed
from dcmp_hil.platform.host_info import contention
from sim_backend.board import build
from sim_backend.compiling import cache

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

_KEY = "controller.kp_1_s2"
_ENDLESS = {
    "dotted key": ["controller." + "a." * 50_000 + "b=1"],
    "dots alone": ["." * 100_000 + "=1"],
    "open brackets": [f"{_KEY}=" + "[" * 100_000],
    "tables in tables": [f"{_KEY}=" + "{a=" * 1_000 + "1" + "}" * 1_000],
    "digits": [f"{_KEY}=" + "1" * 100_000],
    "text": [f'{_KEY}="' + "x" * 100_000 + '"'],
    "escapes": [f'{_KEY}="' + "\\u001b" * 20_000 + '"'],
    "list": [f"{_KEY}=[" + "1," * 50_000 + "]"],
    "no equals sign": ["x" * 100_000],
    "many keys": [f"controller.k{number}=1" for number in range(5_000)],
}


@pytest.mark.parametrize("overrides", _ENDLESS.values(), ids=list(_ENDLESS))
def test_endless_override_is_refused_in_a_few_lines_and_at_once(overrides: list[str]) -> None:
    rig = load_rig("bench-1khz")
    began = time.process_time()
    with pytest.raises(ConfigError) as refused:
        changed(rig, overrides)
    assert len(str(refused.value)) < 1_000
    assert time.process_time() - began < 1.0  # 14 s of this process for the dotted key before


def test_endless_override_is_one_line_of_the_command(script: Callable[..., Finished], tmp_path: Path) -> None:
    done = script("check", "bench-1khz", "--set", "controller." + "a." * 20_000 + "b=1", cwd=tmp_path)
    assert (done.code, done.out) == (2, "")
    assert "too long" in done.err
    assert "Traceback" not in done.err
    assert len(done.err) < 1_000
    assert not list(tmp_path.iterdir())


# ------------------------------------------------------------------------------------------ compiled files


@pytest.fixture
def compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, needs_compiler: None) -> Callable[[], Path]:  # noqa: ARG001
    """Return the function that gives a compiled program of a few lines, from a cache of its own."""
    for name, text in (
        ("core/number.h", "int number(void);"),
        ("core/number.c", '#include "number.h"\nint number(void) { return 7; }'),
        ("boards/native/main.c", '#include "number.h"\nint main(void) { return number(); }'),
    ):
        path = tmp_path / "firmware" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")
    monkeypatch.setattr("sim_backend.compiling.build._SOURCE_FOLDERS", (tmp_path / "firmware",))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return build.program


def _works(program: Path) -> bool:
    return subprocess.run([program], check=False).returncode == 7


def test_file_that_was_cut_is_compiled_again(compiled: Callable[[], Path]) -> None:
    program = compiled()
    program.write_bytes(program.read_bytes()[:100])
    assert _works(compiled())


def test_file_with_one_byte_altered_is_compiled_again(compiled: Callable[[], Path]) -> None:
    program = compiled()
    data = bytearray(program.read_bytes())
    data[len(data) // 2] ^= 1
    program.write_bytes(data)
    assert _works(compiled())
    assert compiled().read_bytes() != data


def test_file_that_others_may_write_is_compiled_again(compiled: Callable[[], Path]) -> None:
    program = compiled()
    program.chmod(0o777)
    assert compiled().stat().st_mode & 0o077 == 0


def test_link_in_place_of_the_file_is_not_followed(compiled: Callable[[], Path], tmp_path: Path) -> None:
    program = compiled()
    elsewhere = tmp_path / "elsewhere"
    program.rename(elsewhere)
    program.symlink_to(elsewhere)
    found = compiled()
    assert not found.is_symlink()
    assert _works(found)


def test_folder_that_others_may_write_in_is_closed(compiled: Callable[[], Path]) -> None:
    folder = compiled().parent
    folder.chmod(0o777)
    folder.parent.chmod(0o777)
    assert _works(compiled())
    assert [place.stat().st_mode & 0o022 for place in (folder, folder.parent)] == [0, 0]


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives a file to another user")
def test_folder_and_file_of_another_user_are_not_used(compiled: Callable[[], Path]) -> None:
    program = compiled()
    os.chown(program, 12_345, 12_345)
    assert _works(compiled())
    assert compiled().stat().st_uid == 0
    os.chown(program.parent, 12_345, 12_345)
    with pytest.raises(OpenError, match="XDG_CACHE_HOME") as refused:
        compiled()
    assert str(program.parent) in str(refused.value)


def test_folder_that_is_a_link_is_not_followed(compiled: Callable[[], Path], tmp_path: Path) -> None:
    folder = compiled().parent
    folder.rename(tmp_path / "moved")
    folder.symlink_to(tmp_path / "moved")
    with pytest.raises(OpenError, match="no folder of this user"):
        compiled()


def test_kept_files_of_two_names_do_not_meet(tmp_path: Path) -> None:
    made = tmp_path / "dcmp-native"
    made.write_text("program")
    (tmp_path / "kept").mkdir()
    kept = cache.keep(made, tmp_path / "kept")
    assert cache.find(tmp_path / "kept", "dcmp-native") == kept
    assert cache.find(tmp_path / "kept", "libdcmp.so") is None
    assert kept.exists()


# ------------------------------------------------------------------------------------------ a busy computer


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("11.02 6.10 3.00 11/512 4711\n", "11 threads want its 2 processors"),
        ("0.10 0.10 0.10 2/512 4711\n", ""),
        ("0.10 0.10\n", ""),
        ("a b c d/e f\n", ""),
        ("", ""),
    ],
)
def test_contention_is_told_where_more_threads_run_than_processors(
    tmp_path: Path, text: str, said: str
) -> None:
    (tmp_path / "loadavg").write_text(text)
    assert contention(str(tmp_path / "loadavg"), cpus=2) == said


def test_silent_device_names_the_busy_computer_before_the_cable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dcmp_hil.device.open_errors.contention", lambda: "11 threads want its 2 processors")
    said = str(open_errors.no_sample("/dev/ttyACM0", 0.02, 0, 0))
    assert "busy: 11 threads want its 2 processors" in said
    assert said.index("busy") < said.index("cable")
    monkeypatch.setattr("dcmp_hil.device.open_errors.contention", lambda: "")
    assert "busy" not in str(open_errors.no_sample("/dev/ttyACM0", 0.02, 0, 0))
