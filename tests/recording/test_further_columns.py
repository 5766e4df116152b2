"""Recordings with further columns: whole, damaged, with a schema that was tampered with, and exported."""

from __future__ import annotations

import csv
import struct
from typing import TYPE_CHECKING

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pyarrow import parquet  # type: ignore[import-untyped]

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.recording import export, schema
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.further_columns import CHANNEL_NAMES, FURTHER_MAX
from dcmp_hil.telemetry.signals import names
from tests.attacks.hostile import recordings as made
from tests.attacks.mutations import records
from tests.helpers import bench
from tests.telemetry.runs import EVENTS, blocks

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.recording.reader import RecordedRun

NAMES = ("friction_found_rad_s2", "voltage_demand_kalman_V", "stuck")
_ATTACHMENT, _CHUNK = 0x09, 0x06


def _blocks(periods: int = 500) -> list[Block]:
    """Return a synthetic run with further columns."""
    wide = []
    for block in blocks(periods):
        t = block["t"]
        further = np.stack([1.3 + 0.01 * t, -t, np.where(t > 0.2, 1.0, np.nan)], axis=1)
        wide.append(Block(np.concatenate([block.rows, further], axis=1), block.model, NAMES))
    return wide


def _recorded(path: Path, periods: int = 500) -> np.ndarray:
    """Write a run; return its rows."""
    rig = bench()
    sink = RecordingSink(path, rig.period, about(rig, "a note"), rig_json(rig))
    sink.begin(NAMES)
    for event in EVENTS:
        sink.event(event)
    made = _blocks(periods)
    for block in made:
        sink.block(block)
    sink.close()
    return np.concatenate([block.rows for block in made])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, np.ndarray]:
    """Return a recording's bytes and rows."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    rows = _recorded(path)
    return path.read_bytes(), rows


def _read(folder: Path, content: bytes) -> RecordedRun:
    (folder / "run.mcap").write_bytes(content)
    return read_run(folder)


def _broken(content: bytes, opcode: int, word: bytes = b"") -> bytes:
    """Return the file with the first record of that kind, which has the word in it, damaged at its end."""
    for kind, begin, end in records(content):
        if kind == opcode and word in content[begin:end]:
            return content[: end - 6] + bytes([content[end - 6] ^ 0xFF]) + content[end - 5 :]
    raise AssertionError("there is no such record")


# ------------------------------------------------------------------------------------------------ whole


def test_further_columns_come_back_to_the_bit(tmp_path: Path, whole: tuple[bytes, np.ndarray]) -> None:
    content, rows = whole
    read = _read(tmp_path, content)
    assert read.complete
    assert read.further == NAMES
    assert read.rows.tobytes() == rows.tobytes()
    assert read.events == EVENTS
    assert tuple(read.columns) == names(NAMES)
    assert read.run["format"] == "2"


def test_ros_reads_further_columns_by_name(tmp_path: Path, whole: tuple[bytes, np.ndarray]) -> None:
    content, rows = whole
    (tmp_path / "run.mcap").write_bytes(content)
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        seen = [message for *_, message in reader.iter_decoded_messages(topics=[schema.CYCLES])]
    fields = (*CHANNEL_NAMES, *(name.lower() for name in NAMES))
    np.testing.assert_array_equal(np.array([[getattr(one, name) for name in fields] for one in seen]), rows)


def test_a_block_with_other_columns_is_refused(tmp_path: Path) -> None:
    rig = bench()
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    sink.event(EVENTS[0])  # nothing was said of further columns before it
    with pytest.raises(RuntimeError, match="other columns"):
        sink.block(_blocks(10)[0])
    sink.close()


def test_every_export_has_further_columns(tmp_path: Path, whole: tuple[bytes, np.ndarray]) -> None:
    content, rows = whole
    read = _read(tmp_path, content)
    export.to_csv(read, tmp_path / "run.csv")
    export.to_parquet(read, tmp_path / "run.parquet")
    with (tmp_path / "run.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert tuple(table[0]) == names(NAMES)
    assert [float(row["voltage_demand_kalman_V"]) for row in table] == rows[:, len(FIELDS) + 1].tolist()
    assert table[0]["stuck"] == ""
    columns = parquet.read_table(tmp_path / "run.parquet").to_pydict()
    assert tuple(columns) == names(NAMES)
    assert columns["friction_found_rad_s2"] == rows[:, len(FIELDS)].tolist()
    assert len(read.rows) == len(columns["stuck"]) == 500


def test_the_dashboard_of_a_run_with_further_columns_is_written(
    tmp_path: Path, whole: tuple[bytes, np.ndarray]
) -> None:
    export.to_rrd(_read(tmp_path, whole[0]), tmp_path / "run.rrd")
    assert (tmp_path / "run.rrd").stat().st_size > 10_000


def test_a_replay_takes_the_known_columns(tmp_path: Path, whole: tuple[bytes, np.ndarray]) -> None:
    content, rows = whole
    assert len(reexecute(_read(tmp_path, content)).demand) == len(rows)


# ------------------------------------------------------------------------------------------------ damaged


def test_without_the_block_that_has_the_schema_the_rest_is_read(
    tmp_path: Path, whole: tuple[bytes, np.ndarray]
) -> None:
    content, rows = whole
    read = _read(tmp_path, _broken(content, _CHUNK))
    assert read.damage
    assert read.further == NAMES
    assert 400 < len(read.rows) < len(rows)
    assert read.rows.tobytes() == rows[-len(read.rows) :].tobytes()


def test_names_are_found_at_the_end_where_the_beginning_lost_them(
    tmp_path: Path, whole: tuple[bytes, np.ndarray]
) -> None:
    content, rows = whole
    read = _read(tmp_path, _broken(_broken(content, _CHUNK), _ATTACHMENT, b"further_columns.json"))
    assert read.damage
    assert read.further == NAMES
    assert read.rows.tobytes() == rows[-len(read.rows) :].tobytes()


def test_where_the_names_are_lost_their_columns_are_left_out_and_told(
    tmp_path: Path, whole: tuple[bytes, np.ndarray]
) -> None:
    content, rows = whole
    _, second = [
        begin
        for kind, begin, end in records(content)
        if kind == _ATTACHMENT and b"further_columns.json" in content[begin:end]
    ]
    content = _broken(_broken(content, _CHUNK), _ATTACHMENT, b"further_columns.json")
    read = _read(tmp_path, content[:second])
    assert "the names of its 3 further columns are lost, and so are they" in read.damage
    assert read.further == ()
    assert len(read.rows) > 400
    assert read.rows.tobytes() == rows[-len(read.rows) :, : len(FIELDS)].tobytes()
    assert tuple(read.columns) == names()


def test_cut_anywhere_it_reads_as_far_as_it_goes(tmp_path: Path, whole: tuple[bytes, np.ndarray]) -> None:
    content, rows = whole
    beginning = content.index(b"further_columns.json") + 300
    for cut in range(beginning, len(content) - 1, len(content) // 40):
        read = _read(tmp_path, content[:cut])
        assert read.rows.tobytes() == rows[: len(read.rows)].tobytes()
        assert not read.complete


# ------------------------------------------------------------------------------------------------ tampered


def _wide_row(number: int, further: int) -> bytes:
    values = [number * 1e-3, *[0.0] * (len(FIELDS) - 1 + further)]
    body = struct.pack(f"<{len(values)}d", *values)
    return made.message(1, number, made.BEGAN_NS + round(values[0] * 1e9), b"\0\1\0\0" + body)


def _file(lines: bytes, further: int) -> bytes:
    """Return a recording whose cycles have a schema with these lines behind the known ones."""
    rows = b"".join(_wide_row(number, further) for number in range(1, 51))
    return made.file(
        made.chunk(made.schema(1, schema.CYCLE_SCHEMA + lines) + made.channel(1, "/cycles") + rows),
        end={"periods": 50, "events": 0},
    )


def test_a_sound_schema_made_by_hand_is_read(tmp_path: Path) -> None:
    read = _read(tmp_path, _file(b"\nfloat64 a_rad\nfloat64 voltage_b_v", 2))
    assert read.damage == ()
    assert read.further == ("a_rad", "voltage_b_V")
    assert len(read.rows) == 50


@pytest.mark.parametrize(
    ("lines", "further"),
    [
        (b"\nfloat64 a_rad\nfloat64 a_rad", 2),
        (b"\nfloat64 position_rad", 1),
        (b"\nfloat64 gravity_rad_s2", 1),
        (b"\nfloat64 position", 1),
        (b"\nfloat64 voltage_sent_v", 1),
        (b"".join(b"\nfloat64 c%d" % k for k in range(FURTHER_MAX + 1)), FURTHER_MAX + 1),
        (b"\nfloat64 x" * 100_000, 1),
        (b"\nfloat64 ", 1),
        (b"\n", 1),
        (b"\nfloat32 a_rad", 1),
        (b"\nfloat64 a_rad ", 1),
        (b"\nfloat64 A_rad", 1),
        (b"\nfloat64 a_V", 1),
        (b"\nfloat64 \x1b[31m", 1),
        (b"\nfloat64 \xff\xfe", 1),
        (b"\nfloat64 " + b"x" * 500_000, 1),
        (b" float64 a_rad", 1),
        (b"x", 0),
    ],
)
def test_a_schema_that_no_run_writes_is_refused_in_words(tmp_path: Path, lines: bytes, further: int) -> None:
    read = _read(tmp_path, _file(lines, further))
    assert len(read.rows) == 0
    assert "its periods have other columns than those of this version" in read.damage
    assert not read.complete


def test_rows_shorter_or_longer_than_their_schema_are_left_out(tmp_path: Path) -> None:
    for further in (0, 1, 3):
        read = _read(tmp_path, _file(b"\nfloat64 a_rad\nfloat64 b_rad", further))
        assert len(read.rows) == 0
        assert "a period has not the numbers that a period has" in read.damage


def test_names_in_an_attachment_that_no_run_writes_are_left_out(tmp_path: Path) -> None:
    rows = made.chunk(b"".join(_wide_row(number, 1) for number in range(1, 51)))
    for said in (b"[1]", b"{}", b'["position_rad"]', b'["a", "b"]', b'["\\u001b"]', b"[", b"[" * 100_000):
        read = _read(tmp_path, made.file(made.attachment("further_columns.json", said), rows))
        assert "the names of its 1 further columns are lost, and so are they" in read.damage
        assert read.rows.shape == (50, len(FIELDS))
    read = _read(tmp_path, made.file(made.attachment("further_columns.json", b'["a_rad"]'), rows))
    assert read.further == ("a_rad",)
