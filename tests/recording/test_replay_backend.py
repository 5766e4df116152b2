"""The loop over a recording: one line for a run and its repetition."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import loop
from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.recording.compare import compare
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.replay_backend import RecordedSupervisor, ReplayBackend
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.values import Sample, Truth
from tests.helpers import bench
from tests.live.here import ChangedRun
from tests.recording.test_reexecute import record

if TYPE_CHECKING:
    from pathlib import Path

ROWS = np.arange(3.0 * len(FIELDS)).reshape(3, -1)


def test_samples_and_truth_are_the_recorded_ones_up_to_the_end() -> None:
    ROWS[:, FIELDS.index("fault")] = (0.0, 3.0, 0.0)
    with ReplayBackend(ROWS) as backend:
        for row, fault in zip(ROWS, (0, 3, 0), strict=True):
            assert not backend.requested
            sample = backend.read()
            assert sample == Sample(row[0], row[1], row[2], fault)
            assert type(sample.fault) is int
            first = FIELDS.index("position_true")
            assert backend.truth() == Truth(*row[first : first + 3])
        assert backend.requested
    assert ReplayBackend(ROWS[:0]).requested


def test_the_trajectory_begins_once_and_where_its_cycle_is_missing_in_the_next() -> None:
    rows = np.zeros((5, len(FIELDS)))
    rows[:, 0] = (0.0, 0.1, 0.3, 0.4, 0.5)
    rows[:, FIELDS.index("began")] = (math.inf, math.inf, 0.2, 0.2, 0.2)
    backend = ReplayBackend(rows)
    supervisor = RecordedSupervisor(backend)
    assert [supervisor.engages(backend.read()) for _ in rows] == [False, False, True, False, False]


@pytest.mark.parametrize("end", ["lower", "release"])
def test_a_repetition_is_the_loop_itself(end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recorded = read_run(record(tmp_path, f"run.end={end}", duration=0.6))
    seen: list[tuple[float, float]] = []
    run = loop.run

    def watched(stages: loop.LoopStages, until: float, stop: loop.StopFlag) -> float:
        last = run(stages, until, stop)
        seen.append((until, last))
        return last

    monkeypatch.setattr(loop, "run", watched)
    assert compare(recorded, reexecute(recorded)).identical
    last = float(recorded.rows[-1, 0])
    lowered = [(seen[0][0], seen[0][0])] if end == "lower" else []
    assert seen == [*lowered, (math.inf, last)]


def test_a_change_in_the_cycle_of_the_way_down_is_made_again_before_it(tmp_path: Path) -> None:
    overrides = ("controller.friction_feedforward=true", "run.end=lower")
    rig = bench(*overrides)
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    script: dict[int, Any] = {1999: ("reference.rate_rad_s=1.25",)}  # applied in the last cycle before it
    ChangedRun(script, *overrides, duration=2.0, sinks=[sink]).run()
    recorded = read_run(tmp_path)
    times = {event.kind.value: event.t for event in recorded.events if event.kind in {"change", "lowering"}}
    assert times["change"] == times["lowering"]
    assert compare(recorded, reexecute(recorded)).identical
