"""A2. Who attacks: disks, cables and people that change a recording in any place, by a bit or by a block.

What is promised: no row that reader, replay or export give is wrong without a word. What is damaged is left
out and told with its device time; what lies behind it is read; the exit code is 6; results are written.
"""

from __future__ import annotations

import json
import os
import random
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import run
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording import export
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import RecordedRun, read_run
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.writer import RecordingSink
from tests.attacks.mutations import KINDS, mutant, records
from tests.helpers import bench
from tests.memory import forget_peak, peak_mb

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.installed import Finished

    Script = Callable[..., Finished]

_MUTANTS = int(os.environ.get("DCMP_MUTATED", "2000"))
_SEED = int(os.environ.get("DCMP_MUTATED_SEED", "12"))
_THROUGH_THE_SCRIPT = 40
_MEMORY_MB = 500
_CHUNK = 0x06
OLDER = Path(__file__).parents[1] / "recording" / "data" / "format_1.mcap"


@dataclass(frozen=True)
class Original:
    """A recording before mutation.

    Parameters
    ----------
    content
        The file.
    read
        What is in it.
    place
        Bytes of each row to its number.
    lines
        Of its CSV.
    """

    content: bytes
    read: RecordedRun
    place: dict[bytes, int]
    lines: list[bytes]


def _record(path: Path, *overrides: str, duration: float = 1.0) -> bytes:
    rig = bench(*overrides)
    sink = RecordingSink(path, rig.period, about(rig, "a note"), rig_json(rig))
    run(rig, duration=duration, fast=True, sinks=[sink])
    return path.read_bytes()


def _original(folder: Path, content: bytes) -> Original:
    path = folder / "run.mcap"
    path.write_bytes(content)
    read = read_run(path)
    export.to_csv(read, folder / "out.csv")
    lines = (folder / "out.csv").read_bytes().splitlines()
    return Original(content, read, {row.tobytes(): k for k, row in enumerate(read.rows)}, lines)


@pytest.fixture(scope="module")
def originals(tmp_path_factory: pytest.TempPathFactory) -> list[Original]:
    """Return runs of one second: an usual one, one with further columns, one in the older layout."""
    folder = tmp_path_factory.mktemp("originals")
    usual = _original(folder, _record(folder / "run.mcap"))
    other = _record(folder / "run.mcap", "controller.kind=pd", "observer.kind=friction_kalman")
    return [usual, _original(folder, other), _original(folder, OLDER.read_bytes())]


def _wrong(original: Original, got: RecordedRun) -> str:
    """Return what is wrong with it without a word; nothing if all is right or told."""
    known = [original.place.get(row.tobytes(), -1) for row in got.rows]
    if -1 in known or known != sorted(set(known)):
        return "a row that was never written, or in a wrong place"
    whole = original.read
    same = len(known) == len(whole.rows) and got.events == whole.events
    same = same and (got.rig, got.run) == (whole.rig, whole.run)
    if not same and not (got.damage or got.unchecked):
        return "something is missing without a word"
    if got.complete and not same:
        return "it says that it is complete"
    there = set(known)
    missing = [t for k, t in enumerate(whole.rows[:, 0]) if k not in there]
    for t in missing:
        if not any((g.start is None or g.start < t) and (g.stop is None or t < g.stop) for g in got.gaps):
            return f"that {t} s is missing is not told"
    counted = sum(gap.periods or 0 for gap in got.gaps)
    if counted != len(missing) and None not in {gap.periods for gap in got.gaps}:
        return "the number of missing periods is wrong"
    return ""


def _wrong_lines(original: Original, csv: Path) -> str:
    """Return what is wrong with a CSV: each of its lines is one of the original's, in their order."""
    places = {line: k for k, line in enumerate(original.lines)}
    found = [places.get(line, -1) for line in csv.read_bytes().splitlines()]
    return "" if -1 not in found and found == sorted(set(found)) else "a line that was never written"


@pytest.mark.untraced
def test_two_thousand_mutants_give_no_wrong_row(originals: list[Original], tmp_path: Path) -> None:
    before = forget_peak()
    chance = random.Random(_SEED)
    path, csv = tmp_path / "run.mcap", tmp_path / "out.csv"
    told: Counter[str] = Counter()
    wrong: list[str] = []
    again: dict[int, set[bytes]] = {}  # what was replayed and exported already, to the bit
    for number in range(_MUTANTS):
        k = chance.choices(range(3), [4, 3, 3])[0]
        original = originals[k]
        kind, content = mutant(original.content, originals[k - 1].content, chance)
        path.write_bytes(content)
        try:
            got = read_run(path)
        except ConfigError as error:
            told[f"{kind}: refused"] += 1
            if str(path) not in str(error):
                wrong.append(f"{number} {kind}: {error}")
            continue
        told[f"{kind}: {'complete' if got.complete else 'told'}"] += 1
        if fault := _wrong(original, got):
            wrong.append(f"{number} {kind}: {fault}")
        seen = again.setdefault(k, set())
        key = got.rows.tobytes() + repr(got.events).encode()
        if key in seen or not len(got.rows):
            continue
        seen.add(key)
        export.to_csv(got, csv)
        if fault := _wrong_lines(original, csv):
            wrong.append(f"{number} {kind}: {fault}")
        assert len(reexecute(got).demand) == len(got.rows)
    assert wrong == []
    assert {kind.partition(":")[0] for kind in told} == set(KINDS)
    assert sum(told.values()) == _MUTANTS
    print(dict(sorted(told.items())))  # noqa: T201 - the table, for who asks with -s
    assert peak_mb() - before < _MEMORY_MB


def test_blocks_behind_a_hole_are_read_and_the_hole_has_its_time(
    originals: list[Original], tmp_path: Path
) -> None:
    original = originals[0]
    chunks = [(start, end) for opcode, start, end in records(original.content) if opcode == _CHUNK]
    start, end = chunks[9][0], chunks[13][1]
    content = bytearray(original.content)
    content[start + 100 : end - 100] = bytes(end - start - 200)
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    got = read_run(path)
    (gap,) = got.gaps
    assert not got.complete
    assert len(got.rows) == 1000 - (gap.periods or 0) > 800
    missing = {row.tobytes() for row in original.read.rows} - {row.tobytes() for row in got.rows}
    times = sorted(original.read.rows[original.place[row], 0] for row in missing)
    assert gap.start is not None
    assert gap.stop is not None
    assert gap.start < times[0]
    assert times[-1] < gap.stop
    assert gap.periods == len(times)
    assert f"{gap.periods} periods missing, device time {gap.start:.6g} s to {gap.stop:.6g} s" in got.damage


def test_the_older_layout_is_read_and_what_it_cannot_check_is_told(
    originals: list[Original], tmp_path: Path, script: Script
) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(originals[2].content)
    got = read_run(path)
    assert len(got.rows) > 500
    assert got.gaps == ()
    assert (got.complete, got.damage, len(got.unchecked)) == (False, (), 1)
    done = script("export", str(path), "--csv", "out.csv", cwd=tmp_path)
    assert done.code == 0
    assert "under no checksum" in done.err


def test_through_the_script_it_ends_with_6_and_results_are_written(
    originals: list[Original], tmp_path: Path, script: Script
) -> None:
    chance = random.Random(_SEED + 1)
    codes: Counter[int] = Counter()
    for number in range(_THROUGH_THE_SCRIPT):
        original = originals[number % 2]
        kind, content = mutant(original.content, originals[1 - number % 2].content, chance)
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "run.mcap").write_bytes(content)
        if number % 2:
            done = script("export", "run.mcap", "--csv", "out.csv", cwd=folder)
        else:
            done = script("replay", "run.mcap", "--csv", "out.csv", "--json", "out.json", cwd=folder)
        codes[done.code] += 1
        assert "Traceback" not in done.err, kind
        if done.code == 0:
            assert content == original.content or "warning:" not in done.err
        elif done.code == 6 and (folder / "out.csv").exists():
            assert "error: run.mcap is incomplete or damaged" in done.err, kind
            assert "warning: run.mcap: " in done.err
            if number % 2:
                assert not _wrong_lines(original, folder / "out.csv"), kind
            else:
                assert json.loads((folder / "out.json").read_text())["rows"] > 0
        else:
            assert done.code in {2, 6}, kind
            assert "error: run.mcap" in done.err, kind
    assert codes[6] > _THROUGH_THE_SCRIPT // 2
