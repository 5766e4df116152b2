"""Columns, written as a Rerun recording."""

from __future__ import annotations

from datetime import timedelta
from typing import TYPE_CHECKING

import numpy as np
import pytest
import rerun as rr

from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.rerun.series import write_series
from tests.telemetry.runs import entities, read_back, values

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture(autouse=True)
def _strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def test_lines_arrive_as_they_are(tmp_path: Path) -> None:
    path, time = tmp_path / "replay.rrd", np.linspace(0.0, 4.999, 5000)
    lines = {"estimate": np.sin(time), "reference": np.where(time < 1.0, np.nan, np.cos(time)), "odd": time}
    write_series(path, "dcmp-hil replay", time, {"joint/velocity_rad_s": lines})
    np.testing.assert_array_equal(
        values(path, "joint/velocity_rad_s"), np.stack(list(lines.values()), axis=1)
    )
    table = read_back(path, "joint/velocity_rad_s")
    assert table["SeriesLines:names"] == [["estimate", "reference", "odd"]]
    assert table["loop_time"] == [timedelta(milliseconds=k) for k in range(5000)]


def test_lines_without_a_value_are_left_out(tmp_path: Path) -> None:
    path, time = tmp_path / "replay.rrd", np.arange(10.0)
    nothing = np.full(10, np.nan)
    write_series(path, "a", time, {"joint/a_rad": {"given": nothing, "b": time}, "joint/c": {"d": nothing}})
    assert read_back(path, "joint/a_rad")["SeriesLines:names"] == [["b"]]
    assert "joint/c" not in entities(path)


def test_unwritable_file_is_a_config_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"Choose a file you may write"):
        write_series(tmp_path / "no" / "a.rrd", "a", np.arange(2.0), {})
