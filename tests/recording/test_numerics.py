"""Versions of the numerics: a recording replays to the bit by the functions that it was made with."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.config import change_rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.compare import compare
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.writer import RecordingSink
from tests.helpers import bench
from tests.recording.test_reexecute import record

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]

BEFORE = Path(__file__).with_name("data") / "numerics_1"
"""Of 60, 50, 51 and 33 periods, made by the program of before; gains were changed on the way in three."""
NAMES = ("super_twisting", "friction_kalman", "lost_samples", "odd_steps")


@pytest.mark.parametrize("name", NAMES)
def test_a_recording_of_numerics_1_replays_to_the_bit(name: str) -> None:
    run = read_run(BEFORE / f"{name}.mcap")
    assert b'"numerics"' not in run.path.read_bytes()
    assert run.complete
    assert run.run["numerics"] == "1"
    assert compare(run, reexecute(run)).identical


@pytest.mark.parametrize("name", NAMES)
def test_numerics_2_gives_other_bits_and_the_same_figures(name: str) -> None:
    run = read_run(BEFORE / f"{name}.mcap")
    again = reexecute(replace(run, run={**run.run, "numerics": "2"}))
    assert not compare(run, again).identical
    np.testing.assert_allclose(again.estimate, reexecute(run).estimate, rtol=1e-7, atol=1e-7)


def test_an_observer_beside_the_loop_had_the_bits_that_its_repetition_has() -> None:
    run = read_run(BEFORE / "super_twisting.mcap")
    again = reexecute(run, change_rig(run.rig, ["observer.kind=friction_kalman"]))
    np.testing.assert_array_equal(again.estimate, run.rows[:, -4:-1])
    np.testing.assert_array_equal(again.demand, run.rows[:, -1])


def test_other_settings_are_repeated_by_numerics_1_too(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "figures.json"
    path = str(BEFORE / "super_twisting.mcap")
    outcome = cli("replay", path, "--compare", "friction_kalman,kalman", "--json", str(file))
    assert outcome.code == 0
    assert "to the bit" in outcome.out.replace("\n", " ")
    assert json.loads(file.read_text())["identical"] is True
    outcome = cli("replay", path, "--mu0", "60")
    assert outcome.code == 0
    assert "the numbers differ" in outcome.out.replace("\n", " ")


def test_a_new_recording_says_its_numerics_and_replays_by_them(tmp_path: Path) -> None:
    run = read_run(record(tmp_path, "encoder.counts_per_rev=2000", duration=1.5))
    assert run.run["numerics"] == "2"
    assert compare(run, reexecute(run)).identical


def test_numerics_of_a_newer_version_are_refused_with_the_remedy(tmp_path: Path) -> None:
    rig = bench()
    path = tmp_path / "run.mcap"
    RecordingSink(path, rig.period, about(rig) | {"numerics": "3"}, rig_json(rig)).close()
    with pytest.raises(ConfigError, match=r"numerics 3; this version .* Use dcmp-hil"):
        read_run(path)
