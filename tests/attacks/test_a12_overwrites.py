"""A12, files. Who attacks: a user in a hurry, who names a file that matters as the place of an output.

What is promised: what is there is overwritten with --force alone; the rig that is run, the recording that is
read, and the file of a reference never are, by none of their names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil import run
from dcmp_hil.cli.outputs import try_places
from dcmp_hil.config import copy_rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.writer import RecordingSink
from tests.cli.conftest import cli
from tests.helpers import bench

__all__ = ["cli"]

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.cli.conftest import Outcome
    from tests.installed import Finished

    Script = Callable[..., Finished]
    Cli = Callable[..., Outcome]

_QUICK = ("--fast", "--duration", "0.3", "--viewer", "none", "--no-record")
_THERE = {
    "run --json": ("run", "my.toml", *_QUICK, "--json", "there"),
    "run --record": ("run", "my.toml", *_QUICK, "--record", "there"),
    "export --csv": ("export", "run.mcap", "--csv", "there"),
    "export --parquet": ("export", "run.mcap", "--parquet", "there"),
    "export --rrd": ("export", "run.mcap", "--rrd", "there"),
    "replay --csv": ("replay", "run.mcap", "--csv", "there"),
    "replay --json": ("replay", "run.mcap", "--json", "there"),
    "replay --rrd": ("replay", "run.mcap", "--rrd", "there"),
}


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Give a folder with a rig, a recording, and a file that matters."""
    copy_rig("bench-1khz", tmp_path / "my.toml")
    rig = bench()
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    run(rig, duration=0.3, fast=True, sinks=[sink])
    (tmp_path / "there").write_text("mine")
    return tmp_path


@pytest.mark.parametrize("command", _THERE.values(), ids=_THERE)
def test_what_is_there_is_overwritten_with_force_alone(
    command: tuple[str, ...], place: Path, cli: Cli
) -> None:
    refused = cli(*command)
    assert (refused.code, refused.out) == (2, "")
    assert "there: is there already. Write elsewhere, or overwrite it with --force." in refused.err
    assert (place / "there").read_text() == "mine"
    forced = cli(*command, "--force")
    assert forced.code == 0, forced.err
    assert (place / "there").read_bytes() != b"mine"


def _names(file: Path) -> dict[str, str]:
    """Return other names of one file: links and other spellings."""
    (file.parent / "soft").symlink_to(file)
    (file.parent / "hard").hardlink_to(file)
    (file.parent / "folder").mkdir()
    (file.parent / "door").symlink_to(file.parent / "folder" / "..")
    return {
        "itself": file.name,
        "another spelling": f"./folder/../{file.name}",
        "symbolic link": "soft",
        "hard link": "hard",
        "linked folder": f"door/{file.name}",
        "whole path": str(file),
    }


@pytest.mark.parametrize(
    ("file", "command"),
    [
        ("my.toml", ("run", "my.toml", *_QUICK, "--force", "--json")),
        ("my.toml", ("run", "my.toml", *_QUICK, "--force", "--record")),
        ("run.mcap", ("export", "run.mcap", "--force", "--csv")),
        ("run.mcap", ("replay", "run.mcap", "--force", "--json")),
    ],
)
def test_what_is_read_is_never_overwritten(
    file: str, command: tuple[str, ...], place: Path, cli: Cli
) -> None:
    before = (place / file).read_bytes()
    named = _names(place / file)
    for name in (named["hard link"], named["linked folder"]):
        refused = cli(*command, name)
        assert (refused.code, refused.out) == (2, ""), name
        assert " itself. Write elsewhere." in refused.err
    for name in named.values():
        with pytest.raises(ConfigError, match=r"is the file itself\. Write elsewhere\."):
            try_places({"--out": place / name}, {"the file": place / file}, force=True)
    assert (place / file).read_bytes() == before


def test_the_file_of_a_reference_is_never_overwritten(place: Path, cli: Cli) -> None:
    points = place / "points.csv"
    points.write_text("time_s,position_rad\n0,0\n1,0.5\n2,0\n")
    reference = ("--set", "reference.kind=csv", "--set", "reference.file=points.csv")
    refused = cli("run", "my.toml", *_QUICK, *reference, "--force", "--json", "points.csv")
    assert refused.code == 2
    assert "is the file of the reference itself" in refused.err
    assert points.read_text().startswith("time_s")


def test_a_replay_of_a_csv_leaves_what_an_earlier_one_wrote(place: Path, cli: Cli) -> None:
    assert cli("export", "run.mcap", "--csv", "run.csv").code == 0
    columns = ("--position", "position_rad", "--voltage", "voltage_applied_V", "--velocity", "none")
    options = ("replay", "run.csv", *columns, "--from", "0.1")
    for number in ("", "-2"):
        done = cli(*options)
        assert done.code == 0, done.err
        assert f"wrote run-replay{number}.csv" in done.err
    first = (place / "run-replay.csv").stat().st_mtime_ns
    assert cli(*options, "--force").code == 0
    assert (place / "run-replay.csv").stat().st_mtime_ns > first


@pytest.mark.usefixtures("place")
def test_devices_need_no_force(cli: Cli) -> None:
    done = cli("export", "run.mcap", "--csv", "/dev/null")
    assert done.code == 0, done.err


def test_the_script_says_it_in_one_line(place: Path, script: Script) -> None:
    done = script("run", "my.toml", *_QUICK, "--force", "--json", "my.toml", cwd=place)
    assert (done.code, done.out) == (2, "")
    assert done.err == "error: --json my.toml: is the rig itself. Write elsewhere.\n"
