"""Places that a command writes to: tried before the work, and left as they are by what never began."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.cli.outputs import try_folder, try_places
from dcmp_hil.common.atomic_file import write_text
from dcmp_hil.errors import ConfigError
from tests.installed import Finished, environment

if TYPE_CHECKING:
    from collections.abc import Callable

    Script = Callable[..., Finished]

TIMEOUT_S = 120.0  # s


def everything(folder: Path) -> dict[str, tuple[int, int, int]]:
    """Return what would show that a file was touched."""
    found = {}
    for path in sorted(folder.rglob("*")):
        status = path.lstat()
        found[str(path.relative_to(folder))] = (status.st_size, status.st_mtime_ns, status.st_ino)
    return found


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ("nowhere/x", "there is no folder"),
        ("folder", "it is a folder"),
        ("file/x", "Not a directory"),
        ("n" * 300, "File name too long"),
        ("loop", "symbolic links"),
        ("dangling", "there is no folder"),
        ("nul\0x", "null"),
        ("rig.toml", "is the rig itself"),
    ],
)
def test_place_that_cannot_be_written_is_refused_and_nothing_is_touched(
    tmp_path: Path, place: str, reason: str
) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("a")
    (tmp_path / "rig.toml").write_text("a")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "dangling").symlink_to(tmp_path / "gone" / "x")
    before = everything(tmp_path)
    with pytest.raises(ConfigError, match=rf"^--json .*{reason}"):
        try_places({"--json": tmp_path / place}, {"the rig": tmp_path / "rig.toml"})
    assert everything(tmp_path) == before


def test_places_that_can_be_written_are_left_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "old").write_text("a")
    (tmp_path / "link").symlink_to(tmp_path / "old-too")
    os.mkfifo(tmp_path / "pipe")
    before = everything(tmp_path)
    names = {"--json": "old", "--record": "new", "--csv": "link", "--rrd": "pipe"}
    try_places({option: tmp_path / name for option, name in names.items()}, force=True)
    try_places({"--json": None, "--record": Path("/dev/full"), "--csv": Path("/dev/full")})
    try_folder("--out", tmp_path / "a" / "b")
    assert everything(tmp_path) == before
    with pytest.raises(ConfigError, match=r"--csv .*is where --json goes, too"):
        try_places({"--json": tmp_path / "old", "--csv": tmp_path / "." / "old"}, force=True)
    with pytest.raises(ConfigError, match=r"--out .*is no folder"):
        try_folder("--out", tmp_path / "old" / "b")


def test_text_that_cannot_be_written_wholly_leaves_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "figures.json"
    write_text(target, "old")
    target.chmod(0o640)
    with pytest.raises(UnicodeEncodeError):
        write_text(target, "new" * 10_000 + "\udcff")
    assert target.read_text() == "old"
    write_text(target, "new")
    assert (target.read_text(), target.stat().st_mode & 0o777) == ("new", 0o640)
    (tmp_path / "link").symlink_to(target)
    write_text(tmp_path / "link", "newer")
    assert target.read_text() == "newer"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figures.json", "link"]
    write_text(Path("/dev/null"), "gone")


NEVER_BEGAN = {
    "duration": (2, "--duration", "-1"),
    "window": (2, "--fast", "--duration", "5", "--from", "40"),
    "module": (2, "--fast", "--set", "controller.kind=nowhere:Thing"),
    "fast-hardware": (2, "bench-serial", "--fast"),
    "no-port": (3, "bench-serial", "--set", "backend.port=/dev/there-is-none"),
    "rig": (2, "--duration", "5", "--set", "encoder.counts_per_rev=0"),
}


@pytest.mark.parametrize("name", NEVER_BEGAN)
def test_run_that_never_began_leaves_and_replaces_nothing(script: Script, tmp_path: Path, name: str) -> None:
    code, *arguments = NEVER_BEGAN[name]
    for place in ("old.json", "old.rrd"):
        (tmp_path / place).write_text("old")
    before = everything(tmp_path)
    outputs = ("--viewer", "none", "--json", "old.json", "--record", "old.rrd", "--force")
    done = script("run", *map(str, arguments), *outputs)
    assert done.code == code
    assert done.out == ""
    assert "Traceback" not in done.err
    assert done.err.lower().count("error") == 1
    assert everything(tmp_path) == before


@pytest.mark.parametrize(
    "command",
    [
        ("run", "--fast", "--json", "nowhere/x"),
        ("run", "--fast", "--no-record", "--record", "nowhere/x"),
        ("replay", "no.csv", "--csv", "nowhere/x"),
        ("export", "run.mcap", "--parquet", "nowhere/x"),
        ("paper", "--json", "nowhere/x"),
    ],
)
def test_command_refuses_a_place_before_it_works(
    script: Script, tmp_path: Path, command: tuple[str, ...]
) -> None:
    (tmp_path / "run.mcap").touch()
    done = script(*command)
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        f"error: {command[-2]} nowhere/x: there is no folder {tmp_path}/nowhere. "
        "Choose a file you may write, in a folder that exists.\n"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_current_folder_that_is_gone_is_told_in_a_line(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    line = 'rmdir ../gone && exec "$0" run --fast --duration 1 --json x.json'
    done = subprocess.run(
        ["sh", "-c", line, str(installed)],
        cwd=tmp_path / "gone",
        env=environment(),
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1


def limited(installed: Path, folder: Path, *arguments: str) -> Finished:
    """Run the script where no file may grow beyond 8 kB, which a program meets like a disk that is full."""
    done = subprocess.run(
        ["sh", "-c", 'ulimit -f 16 && exec "$0" "$@"', str(installed), *arguments],
        cwd=folder,
        env=environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    return Finished(done.returncode, done.stdout, done.stderr)


def test_disk_that_fills_up_is_told_for_each_file_after_the_figures(
    script: Script, installed: Path, tmp_path: Path
) -> None:
    rows = (f"{k * 1e-3},{0.1 * math.sin(k * 5e-3)},0.1" for k in range(1500))
    (tmp_path / "run.csv").write_text("\n".join(["time_s,position_rad,voltage_V", *rows]) + "\n")
    replay = limited(installed, tmp_path, "replay", "run.csv")
    assert replay.code == 2
    assert "velocity error, RMS" in replay.out
    assert [line.split(":")[1] for line in replay.err.splitlines() if line.startswith("error: ")] == [
        " run-replay.csv",
        " run-replay.rrd",
    ]
    run = script("run", "--fast", "--duration", "1", "--viewer", "none", "--json", "/dev/full")
    assert run.code == 0
    assert "velocity error" in run.out
    assert run.err.count("warning: --json /dev/full: No space left on device.") == 1
    (folder,) = (tmp_path / "runs").iterdir()
    (tmp_path / "old").touch()
    export = limited(
        installed, tmp_path, "export", str(folder), "--csv", "csv", "--parquet", "old", "--force"
    )
    assert (export.code, export.out) == (2, "")
    assert export.err.count("File too large") == export.err.count("\n") == 2
    assert (tmp_path / "old").exists()  # pyarrow removes what it cannot write to
    assert "Traceback" not in run.err + export.err + replay.err


def test_rig_that_cannot_be_copied_wholly_is_not_there(installed: Path, tmp_path: Path) -> None:
    done = limited(installed, tmp_path, "rigs", "--copy", "paper", "mine.toml")
    assert (done.code, done.out) == (2, "")
    assert done.err == "error: mine.toml: File too large. Choose a place you may write.\n"
    assert list(tmp_path.iterdir()) == []


def test_trip_stays_the_end_of_a_run_whose_json_cannot_be_written(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "place").mkdir()
    command = [str(installed), "run", "--duration", "6", "--viewer", "none", "--json", "place/x.json"]
    run = subprocess.Popen(
        [*command, "--fault", "plant.enc_stuck:at=3s"],
        cwd=tmp_path,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + TIMEOUT_S
    while not any(path.stat().st_size > 30_000 for path in tmp_path.glob("runs/*/run.mcap")):
        assert time.monotonic() < end
        time.sleep(0.05)
    shutil.rmtree(tmp_path / "place")
    out, err = run.communicate(timeout=TIMEOUT_S)
    assert run.returncode == 4
    assert "velocity error" in out
    assert err.count("warning: --json place/x.json: No such file or directory") == 1
    assert err.splitlines()[-1].startswith("error: The encoder shows the same position")
    assert "Traceback" not in err
    (folder,) = (tmp_path / "runs").iterdir()
    assert json.loads((folder / "summary.json").read_text())["ended_by"] == "stuck"
    assert (folder / "black_box.csv").stat().st_size > 10_000
