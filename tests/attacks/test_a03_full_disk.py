"""A3. Who attacks: a disk that is full for a moment, again and again, or to the end.

What is promised: run.mcap is written as soon as there is room, and misses nothing while what waits fits into
its bound; what it misses is told with its device time; a run that is not wholly in it ends with code 6. Small
files are whole or absent. Space is looked at before a run.
"""

from __future__ import annotations

import errno
import json
import random
import sys
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.cli.recording_check import check_recording, space_warning
from dcmp_hil.errors import IncompleteError
from dcmp_hil.recording.completeness import ending_of
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.write_buffer import WriteBuffer
from dcmp_hil.recording.writer import RecordingSink
from tests.helpers import bench
from tests.namespaces import on_disk_of
from tests.telemetry.runs import EVENTS, blocks

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

    Script = Callable[..., Finished]

_TIMEOUT_S = 240.0  # s: these machines are shared
_SEED_COUNT = 40
_PERIODS = 1500
_FILLER = """
import glob, os, random, sys, time
chance = random.Random(int(sys.argv[1]))
while not any(os.path.getsize(file) > 60_000 for file in glob.glob("runs/*/run.mcap")):
    time.sleep(0.01)
for _ in range(int(sys.argv[2])):
    with open("runs/filler", "wb", buffering=0) as file:
        size = 1 << 16
        while size:
            try:
                file.write(bytes(size))
            except OSError:
                size //= 2
    if sys.argv[3] == "stays":
        break
    time.sleep(chance.uniform(0.3, 0.8))
    os.unlink("runs/filler")
    time.sleep(chance.uniform(0.3, 0.8))
"""


class _Disk:
    """A disk that takes bytes or does not, as chance has it, and breaks off in the middle of a piece."""

    def __init__(self, seed: int, full: float) -> None:
        self._chance = random.Random(seed)
        self._full = full
        self.frees_at_the_end = False

    def open(self, path: Path, room: int) -> WriteBuffer:
        buffer = WriteBuffer(path, room)
        buffer._file.close()  # noqa: SLF001
        buffer._file = _Fickle(path, self)  # type: ignore[assignment] # noqa: SLF001
        return buffer

    def takes(self, size: int) -> int:
        if not self.frees_at_the_end and self._chance.random() < self._full:
            return self._chance.choice([0, 0, size // 2])
        return size


class _Fickle:
    """A file on a disk that is full at times."""

    def __init__(self, path: Path, disk: _Disk) -> None:
        self._file, self._disk, self._begun = path.open("wb", buffering=0), disk, False
        self.fileno, self.seek, self.close = self._file.fileno, self._file.seek, self._file.close

    def write(self, data: memoryview) -> int:
        taken = self._disk.takes(len(data)) if self._begun else len(data)
        self._begun = True
        if not taken:
            raise OSError(errno.ENOSPC, "No space left on device")
        return self._file.write(data[:taken]) or 0


def _recorded(path: Path, disk: _Disk, room: int) -> tuple[RecordingSink, np.ndarray]:
    rig = bench()
    sink = RecordingSink(path, rig.period, about(rig), rig_json(rig), partial(disk.open, room=room))
    made = blocks(_PERIODS)
    for block in made:
        sink.block(block)
    for event in EVENTS:
        sink.event(event)
    disk.frees_at_the_end = True
    sink.close()
    return sink, np.concatenate([block.rows for block in made])


@pytest.mark.parametrize("seed", range(_SEED_COUNT))
def test_moments_of_a_full_disk_cost_nothing(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "run.mcap"
    sink, rows = _recorded(path, _Disk(seed, full=0.7), room=8 << 20)
    read = read_run(path)
    assert read.complete
    assert read.rows.tobytes() == rows.tobytes()
    assert read.events == EVENTS
    assert check_recording(path, len(rows), wait=False).complete
    assert not any("misses" in sentence for sentence in sink.warnings)


@pytest.mark.parametrize("seed", range(_SEED_COUNT))
def test_what_a_full_disk_costs_is_told_with_its_time(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "run.mcap"
    sink, rows = _recorded(path, _Disk(seed, full=0.97), room=20_000)
    read = read_run(path)
    known = {row.tobytes(): k for k, row in enumerate(rows)}
    there = [known[row.tobytes()] for row in read.rows]
    assert there == sorted(set(there))
    assert len(there) < len(rows), "this disk was never full"
    assert sum(gap.periods or 0 for gap in read.gaps) == len(rows) - len(there)
    assert not read.complete
    told = [sentence for sentence in sink.warnings if "misses" in sentence]
    assert told
    ending = ending_of(path)
    assert ending is not None
    assert sum(many for _, _, many in ending.missing) == len(rows) - len(there)
    for (start, stop, _), gap in zip(ending.missing, read.gaps, strict=True):
        assert any(f"{start:.6g} s to {stop:.6g} s" in sentence for sentence in told) or len(told) > 1
        assert gap.start is None or gap.start <= start
    kept = check_recording(path, len(rows), wait=False)
    assert not kept.complete
    assert kept.periods == len(there)


def _on_a_disk(
    size: str, folder: Path, filler: tuple[str, str, str], *command: str
) -> subprocess.CompletedProcess[str]:
    """Run a command where `runs/` is a file system of that size, which another program fills."""
    (folder / "filler.py").write_text(_FILLER)
    beside = (
        '"$0" filler.py "$1" "$2" "$3" & filler=$!; shift 3; "$@"; '
        "code=$?; kill $filler 2>/dev/null; wait $filler; rm -f runs/filler; exit $code"
    )
    return on_disk_of(size, folder, "sh", "-c", beside, sys.executable, *filler, *command)


def test_a_disk_that_fills_and_empties_costs_a_run_nothing(installed: Path, tmp_path: Path) -> None:
    run = ("run", "--duration", "7", "--viewer", "none", "--no-control", "--json", "out.json")
    done = _on_a_disk("6m", tmp_path, (str(_SEED_COUNT), "3", "goes"), str(installed), *run)
    assert "Traceback" not in done.stderr
    (folder,) = (file for file in (tmp_path / "kept").iterdir() if file.is_dir())
    document = json.loads((tmp_path / "out.json").read_text())
    assert (done.returncode, document["ended_by"]) == (0, "duration"), done.stderr
    assert "run.mcap waits: No space left on device. Free some space" in done.stderr
    assert "run.mcap goes on, and nothing is missing." in done.stderr
    read = read_run(folder)
    assert read.complete
    assert len(read.rows) == document["recording"]["periods"] >= 6900
    assert json.loads((folder / "summary.json").read_text())["ended_by"] == "duration"


def test_a_disk_that_stays_full_ends_with_6(installed: Path, tmp_path: Path) -> None:
    run = ("run", "--duration", "4", "--viewer", "none", "--no-control", "--json", "out.json")
    done = _on_a_disk("6m", tmp_path, ("1", "1", "stays"), str(installed), *run)
    document = json.loads((tmp_path / "out.json").read_text())
    assert (done.returncode, document["ended_by"]) == (IncompleteError.exit_code, "recording_incomplete")
    assert document["recording"]["complete"] is False
    assert "its end is missing" in document["recording"]["why"]
    assert done.stderr.splitlines()[-1].startswith("error: runs/")
    (folder,) = (file for file in (tmp_path / "kept").iterdir() if file.is_dir())
    assert not (folder / "summary.json").exists() or (folder / "summary.json").stat().st_size > 0
    assert not list(folder.glob("*.part"))
    read = read_run(folder)
    assert not read.complete
    assert 500 < len(read.rows) < 4000


def test_space_is_looked_at_before_a_run(tmp_path: Path) -> None:
    rig = bench()
    assert not space_warning(tmp_path, 1e9, rig, 30.0, picture=True)
    sentence = space_warning(tmp_path, 5e6, rig, 60.0, picture=True)
    assert "5 MB are free, and 60 s at 1000 Hz need about 18.6 MB, 8.4 of them for run.mcap" in sentence
    assert "--duration 36 at most" in sentence
    assert "ten minutes of a run until Ctrl-C" in space_warning(tmp_path, 5e6, rig, 0.0, picture=False)


@pytest.mark.parametrize("what", ["link", "file"])
def test_a_place_for_runs_that_is_none_is_named(script: Script, tmp_path: Path, what: str) -> None:
    if what == "link":
        (tmp_path / "runs").symlink_to("gone/away")
    else:
        (tmp_path / "runs").write_text("mine")
    done = script("run", "--fast", "--duration", "0.2", "--viewer", "none", cwd=tmp_path)
    assert done.code == 2
    says = "runs is a link to gone/away, which is not there" if what == "link" else "runs is no folder"
    assert done.err.count("\n") == 1
    assert done.err.startswith(f"error: {says}. ")
