"""The picture of a run."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.memory_sink import MemorySink
from tests.telemetry.runs import feed

pytest.importorskip("matplotlib")

from dcmp_hil.telemetry.run_plot import draw_run, thinned
from dcmp_hil.telemetry.signals import ESTIMATE_RGB, REFERENCE_RGB

if TYPE_CHECKING:
    from pathlib import Path


def colours(path: Path) -> set[tuple[int, ...]]:
    from matplotlib.image import imread

    return {
        tuple(row)
        for row in np.unique(np.rint(imread(path)[..., :3].reshape(-1, 3) * 255), axis=0).astype(int)
    }


@pytest.mark.parametrize("known", [True, False])
def test_a_run_is_drawn_in_the_dashboard_s_colours(known: bool, tmp_path: Path) -> None:
    draw_run(feed(MemorySink(), known=known), "synthetic", tmp_path / "run.png")
    assert {ESTIMATE_RGB, REFERENCE_RGB} <= colours(tmp_path / "run.png")


def test_long_runs_keep_their_peaks() -> None:
    time = np.arange(0.0, 200.0, 1e-3)
    values = np.sin(time)
    values[[12_345, 150_001]] = 40.0, -40.0
    values[50_000:60_000] = np.nan
    t, y = thinned(time, values)
    assert len(t) <= 20_000
    assert (np.nanmax(y), np.nanmin(y)) == (40.0, -40.0)
    assert (t[0], t[-1]) == (time[0], time[-1])
    assert np.isnan(y).any()
    assert thinned(time[:20_000], values[:20_000])[0] is not time
    assert len(thinned(time[:20_000], values[:20_000])[0]) == 20_000


def test_missing_columns_are_no_matter(tmp_path: Path) -> None:
    draw_run({"time_s": np.arange(3.0), "period_us": np.ones(3)}, "bare", tmp_path / "run.png")
    assert (tmp_path / "run.png").stat().st_size > 0


@pytest.mark.parametrize("name", ["no/run.png", "run.unknown"])
def test_unwritable_picture_is_a_config_error(name: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"Choose a \.png file"):
        draw_run({"time_s": np.arange(3.0)}, "bare", tmp_path / name)


def test_missing_matplotlib_names_the_extra(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ConfigError, match=r"pip install matplotlib"):
        draw_run({}, "bare", tmp_path / "run.png")
