"""The recording that the project ships: made by its script to the bit, and replayed to the figures it has."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.offline import ReplaySettings, read_recording, replay
from tools.sample_recording import COUNTS_PER_REV, MODEL, RECORDING, recording_text, simulated_rows

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

_BYTES_MAX = 300_000


def test_script_makes_the_recording_again_to_the_bit() -> None:
    assert RECORDING.read_text("utf-8") == recording_text(), "run: python -m tools.sample_recording"
    assert len(RECORDING.read_bytes()) <= _BYTES_MAX


def test_velocity_is_far_better_than_the_drives_own_and_near_the_true_one() -> None:
    result = replay(read_recording(RECORDING), ReplaySettings(ku=MODEL.ku))
    figures, rows = result.figures, simulated_rows()
    assert figures.given_velocity_error_rms_rad_s == pytest.approx(0.177, abs=0.005)
    assert figures.velocity_error_rms_rad_s == pytest.approx(0.083, abs=0.005)
    assert figures.disturbance_sin_correlation is not None
    assert figures.disturbance_sin_correlation > 0.95
    assert figures.counts_per_rev == pytest.approx(COUNTS_PER_REV, abs=1)
    assert figures.lost_samples == rows[-1].number + 1 - len(rows) > 50
    true = np.array([row.true_velocity for row in rows])
    judged = np.array([row.time for row in rows]) >= figures.window_s[0]
    error = (result.estimates.velocity - true)[judged]
    assert np.sqrt(np.mean(error**2)) < 0.1  # rad/s, against the truth, which the command does not have


def test_command_of_the_readme_replays_it(script: Callable[..., Finished], tmp_path: Path) -> None:
    done = script("replay", str(RECORDING), "--ku", "5.4", "--json", "-", cwd=tmp_path)
    assert done.code == 0
    figures = json.loads(done.out)
    assert figures["rows"] == len(simulated_rows())
    assert figures["velocity_error_rms_rad_s"] < figures["given_velocity_error_rms_rad_s"] / 2
    said = done.err.splitlines()
    assert [line.partition(":")[0] for line in said[:4]] == ["time", "position", "voltage", "velocity"]
    assert all(line.startswith(("Counts per revolution", "wrote ")) for line in said[4:]), said
    assert {file.suffix for file in tmp_path.iterdir()} == {".csv", ".rrd"}
