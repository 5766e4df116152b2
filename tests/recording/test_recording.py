"""A run's own recording: everything is in it after any kind of end, and others can read it."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from dcmp_hil import load_rig
from dcmp_hil.config import load_table, shipped_rigs
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.ring import FIELDS, Ring, size_of
from dcmp_hil.recording import schema
from dcmp_hil.recording.metadata import about, git_state, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.session import Session
from dcmp_hil.telemetry.further_columns import CHANNEL_NAMES
from dcmp_hil.values import CauseData, Event, EventKind
from tests.helpers import bench
from tests.telemetry.runs import EVENTS, blocks, cycle, truth

if TYPE_CHECKING:
    from dcmp_hil.telemetry.block import Block

LOST_S = 0.1


def recorded(path: Path, periods: int = 500) -> list[Block]:
    """Write a synthetic run; return its blocks."""
    sink, made = begun(path, periods)
    sink.close()
    return made


def begun(path: Path, periods: int) -> tuple[RecordingSink, list[Block]]:
    """Write a synthetic run without its end."""
    rig = bench()
    sink = RecordingSink(path, rig.period, about(rig, "a note", ["wire.drop"]), rig_json(rig))
    made = blocks(periods)
    for event in EVENTS:
        sink.event(event)
    for block in made:
        sink.block(block)
    return sink, made


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, np.ndarray]:
    """Return a recording's bytes and rows."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    rows = np.concatenate([block.rows for block in recorded(path)])
    return path.read_bytes(), rows


def test_everything_comes_back_to_the_bit(tmp_path: Path) -> None:
    made = recorded(tmp_path / "run.mcap")
    read = read_run(tmp_path)  # the folder will do
    assert read.rows.tobytes() == np.concatenate([block.rows for block in made]).tobytes()
    assert read.events == EVENTS
    assert read.complete
    assert read.rig == bench()
    assert read.run["note"] == "a note"
    assert json.loads(read.run["faults"]) == ["wire.drop"]
    assert json.loads(read.run["host"])["system"] == "Linux"
    assert set(read.columns) > {"time_s", "gravity_rad_s2", "voltage_sent_V"}


def test_numbers_that_are_none_survive(tmp_path: Path) -> None:
    (block,) = blocks(3)
    block.rows[:] = [[math.nan], [math.inf], [-math.inf]]
    rig = bench()
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    sink.block(block)
    sink.event(Event(math.inf, "ERROR", EventKind.TRIP, "so late", CauseData("late")))
    sink.close()
    read = read_run(tmp_path / "run.mcap")
    assert read.rows.tobytes() == block.rows.tobytes()
    assert read.events == (Event(math.inf, "ERROR", EventKind.TRIP, "so late", CauseData("late")),)


def test_ros_reads_every_number_of_every_period(tmp_path: Path) -> None:
    rows = np.concatenate([block.rows for block in recorded(tmp_path / "run.mcap")])
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        seen = [message for *_, message in reader.iter_decoded_messages(topics=[schema.CYCLES])]
        logs = [json.loads(message.data) for *_, message in reader.iter_messages(topics=[schema.EVENTS])]
    table = [[getattr(message, name) for name in CHANNEL_NAMES] for message in seen]
    np.testing.assert_array_equal(np.array(table), rows)
    assert [log["message"] for log in logs] == [event.text for event in EVENTS]


def test_names_have_units_and_are_those_that_ros_allows() -> None:
    assert len(CHANNEL_NAMES) == len(set(CHANNEL_NAMES)) == len(FIELDS)
    assert {"position_rad", "voltage_sent_v", "lateness_s", "disturbance_estimate_rad_s2"} <= set(
        CHANNEL_NAMES
    )
    assert all(name == name.lower() and "__" not in name for name in CHANNEL_NAMES)


# ---------------------------------------------------------------------------------------------- cut off


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_a_file_cut_anywhere_reads_as_far_as_it_goes(
    whole: tuple[bytes, np.ndarray], tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content, rows = whole
    beginning = content.index(b"rig.json") + len(rig_json(bench())) + 200
    cut = data.draw(st.integers(beginning, len(content) - 1))
    tail = data.draw(st.sampled_from([b"", b"\0" * 500, bytes(range(7, 250))]))  # as disks leave them
    path = tmp_path_factory.mktemp("cut") / "run.mcap"
    path.write_bytes(content[:cut] + tail)
    read = read_run(path)
    assert read.rows.tobytes() == rows[: len(read.rows)].tobytes()
    assert not read.complete


def test_what_was_handed_over_is_in_the_file_but_for_30_ms(tmp_path: Path) -> None:
    sink, made = begun(tmp_path / "run.mcap", 700)
    read = read_run(tmp_path)
    sink.close()
    assert not read.complete
    assert len(read.rows) >= sum(map(len, made)) - 30 - 10


_WRITES = """
import sys
from pathlib import Path
from dcmp_hil.platform.clock import pause
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.telemetry.dispatcher import DispatchThread, SinkDispatcher
from dcmp_hil.ipc.ring import Ring
from tests.helpers import bench
import mmap
rate, capacity, folder = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
rig = bench(f"loop.rate_hz={rate}")
with (folder / "ring").open("r+b") as file:
    ring = Ring(capacity, mmap.mmap(file.fileno(), 0))
sink = RecordingSink(folder / "run.mcap", rig.period, about(rig), rig_json(rig))
service = DispatchThread(SinkDispatcher(ring, [sink]), sink.interval)
(folder / "up").write_text("")
while True:
    pause(1.0)
"""


def _waited_s(process: subprocess.Popen[bytes]) -> float:
    """Return how long the threads of a process were ready to run, and its computer ran something else, s."""
    waited_ns = 0
    for thread in Path(f"/proc/{process.pid}/task").iterdir():
        with suppress(OSError):  # one that ends just now
            waited_ns += int((thread / "schedstat").read_text().split()[1])
    return 1e-9 * waited_ns


def _killed(folder: Path, rate: int) -> float:
    """Write rows for half a second, kill the recording process; return the age of the oldest row lost, s.

    The time that a busy computer did not let that process run is left out.
    """
    import mmap

    capacity = 1 << 15
    (folder / "ring").write_bytes(bytes(size_of(capacity)))
    with (folder / "ring").open("r+b") as file:
        ring = Ring(capacity, mmap.mmap(file.fileno(), 0))
    command = [sys.executable, "-c", _WRITES, str(rate), str(capacity), str(folder)]
    with subprocess.Popen(command) as process:
        end = time.monotonic() + 30.0
        while not (folder / "up").exists():
            assert time.monotonic() < end
            time.sleep(0.01)
        pushed: list[float] = []  # s, when each row came, less what the process had waited for a processor
        began = time.monotonic()
        while len(pushed) < 0.5 * rate:
            now, own = time.monotonic(), time.monotonic() - _waited_s(process)
            for k in range(len(pushed), int((now - began) * rate)):
                row = cycle(k)
                ring.push(row._replace(sample=row.sample._replace(t=k / rate)), truth(k))
                pushed.append(own)
            time.sleep(1e-3)
        killed = time.monotonic() - _waited_s(process)
        process.kill()
    lost = pushed[len(read_run(folder).rows) :]
    return killed - lost[0] if lost else 0.0


@pytest.mark.parametrize("rate", [1000, 10_000])
def test_sigkill_loses_a_tenth_of_a_second_at_most(tmp_path: Path, rate: int) -> None:
    """Usually: what a busy computer does not let run has written nothing."""
    lost = []
    for k in range(5):
        (tmp_path / str(k)).mkdir()
        lost.append(_killed(tmp_path / str(k), rate))
    assert sorted(lost)[2] <= LOST_S


def test_a_full_disk_is_told_and_what_is_there_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    sinks = [partial(_limited, path)]
    session = Session(bench("loop.rate_hz=5000"), duration=3.0, sinks=sinks, keep_columns=False)
    session.run()
    result = session.result()
    assert result.summary.periods + result.dropped == 15_000
    waits, incomplete = result.troubles
    assert "waits: File too large. Free some space" in waits
    assert "run.mcap is incomplete: File too large" in incomplete
    assert 1000 < len(read_run(path).rows) < 15_000


def _limited(path: Path) -> RecordingSink:
    import resource

    rig = bench()
    sink = RecordingSink(path, rig.period, about(rig), rig_json(rig))
    resource.setrlimit(resource.RLIMIT_FSIZE, (900_000, resource.RLIM_INFINITY))  # the figures need some
    return sink


# ---------------------------------------------------------------------------------------------- refusals


def test_what_is_no_recording_is_said_to_be_none(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"No such file .*runs/<time>-<rig>"):
        read_run(tmp_path)
    for content in (b"", b"time,position\n", os.urandom(300)):
        (tmp_path / "run.mcap").write_bytes(content)
        with pytest.raises(ConfigError, match="no recording of dcmp-hil"):
            read_run(tmp_path)


def test_a_newer_format_is_refused_by_name(tmp_path: Path) -> None:
    rig = bench()
    RecordingSink(tmp_path / "run.mcap", rig.period, about(rig) | {"format": "3"}, rig_json(rig)).close()
    with pytest.raises(ConfigError, match="a recording of format 3; this version reads 2"):
        read_run(tmp_path)


def test_a_place_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    rig = bench()
    with pytest.raises(ConfigError, match="Choose a folder that you may write in"):
        RecordingSink(tmp_path / "nowhere" / "run.mcap", rig.period, about(rig), rig_json(rig))


@pytest.mark.parametrize("name", shipped_rigs())
def test_every_shipped_rig_comes_back_as_it_was(name: str) -> None:
    rig = load_rig(name)
    assert load_table(json.loads(rig_json(rig))) == rig


def test_a_checkout_says_its_commit_and_elsewhere_there_is_none(tmp_path: Path) -> None:
    assert git_state(tmp_path) == ""
    git = ["git", "-C", str(tmp_path), "-c", "user.name=n", "-c", "user.email=e"]
    (tmp_path / "file").write_text("1")
    for words in (["init", "-q"], ["add", "file"], ["commit", "-qm", "one"]):
        subprocess.run([*git, *words], check=True)
    commit = git_state(tmp_path)
    assert len(commit) == 40
    (tmp_path / "file").write_text("2")
    assert git_state(tmp_path) == f"{commit} (changed)"
