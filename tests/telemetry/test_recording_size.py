"""The size of a live recording: a minute of the bench rig at 1 kHz, as it is written during a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig
from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.session import Session
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.telemetry.runs import chunks

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.values import Event

_SIZE_MAX_BYTES = 16e6  # bytes a minute, with what stands at the beginning of a file
_CHUNKS_MAX = 1800  # a minute: each costs 1.6 kB beside its numbers
_SECONDS = 6  # that are run, then repeated: the compression sees no further than a second
_BLOCK_ROWS = 100  # 0.1 s, as in real time


class _Keeper:
    """A sink that keeps blocks."""

    def __init__(self) -> None:
        self.blocks: list[Block] = []

    def block(self, block: Block) -> None:
        self.blocks.append(block)

    def event(self, event: Event) -> None:
        """Ignore it."""

    def close(self) -> None:
        """Nothing to finish."""


@pytest.fixture(scope="module")
def minute(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the recording of a minute."""
    rig, keeper = load_rig("bench-1khz", []), _Keeper()
    Session(rig, duration=float(_SECONDS), fast=True, sinks=[keeper], keep_columns=False).run()
    record = tmp_path_factory.mktemp("minute") / "run.rrd"
    sink = RerunSink(view_of(rig), record, "none")
    for turn in range(60 // _SECONDS):
        for block in keeper.blocks:
            rows = block.rows.copy()
            rows[:, FIELDS.index("t")] += turn * _SECONDS
            for place in range(0, len(rows), _BLOCK_ROWS):
                sink.block(Block(rows[place : place + _BLOCK_ROWS], block.model))
    sink.close()
    return record


def test_a_minute_is_16_mb_at_most(minute: Path) -> None:
    assert minute.stat().st_size < _SIZE_MAX_BYTES


def test_its_numbers_are_in_few_chunks_on_one_timeline(minute: Path) -> None:
    found = list(chunks(minute))
    assert len(found) < _CHUNKS_MAX
    timelines = {name for chunk in found for name in chunk.timeline_names}
    assert timelines == {"loop_time"}
