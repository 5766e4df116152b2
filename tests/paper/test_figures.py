"""Figures 1 to 4: written, not blank, and a sentence when they cannot be."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from dcmp_hil import ConfigError, paper
from dcmp_hil.paper import Reproduction, draw
from dcmp_hil.paper.panels import FIGURES, series
from dcmp_hil.telemetry.signals import ERROR_RGB, ESTIMATE_RGB, REFERENCE_RGB, TRUE_RGB, VOLTAGE_RGB
from tests.cli.conftest import Outcome

Cli = Callable[..., Outcome]

COLOURS = {
    "figure-1-state.png": (TRUE_RGB, ESTIMATE_RGB),
    "figure-2-estimation-error.png": (ERROR_RGB,),
    "figure-3-tracking.png": (TRUE_RGB, REFERENCE_RGB, ERROR_RGB),
    "figure-4-control.png": (VOLTAGE_RGB, TRUE_RGB, ESTIMATE_RGB),
}


def test_command_draws_four_figures_that_show_their_lines(
    reproduction: Reproduction, cli: Cli, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(paper, "reproduce", lambda: reproduction)
    outcome = cli("paper", "--out", "deep/figures")
    written = sorted((tmp_path / "deep" / "figures").iterdir())
    assert outcome.code == 0
    assert [path.name for path in written] == list(COLOURS)
    for path in written:
        assert path.name in outcome.err
        pixels = np.rint(255 * imread(path)[..., :3]).astype(int)
        assert min(pixels.shape[:2]) >= 800
        for colour in COLOURS[path.name]:
            assert np.count_nonzero((pixels == colour).all(axis=-1)) > 500, (path.name, colour)


def test_every_line_has_a_series_and_every_panel_a_unit(reproduction: Reproduction) -> None:
    table = series(reproduction.corrected)
    for _, panels in FIGURES.values():
        for panel in panels:
            assert any(unit in panel.label for unit in ("rad", ", V"))
            for line in panel.lines:
                assert np.isfinite(table[line.series][1:]).all()  # at t = 0 nothing has moved, w is unknown


def test_disturbance_is_that_of_eq_13(reproduction: Reproduction) -> None:
    table = series(reproduction.corrected)
    np.testing.assert_allclose(table["eta"], 0.84 + 0.2 * np.sin(table["t"] / 5.0), rtol=1e-12)


def test_draw_says_so_when_the_folder_is_a_file(reproduction: Reproduction, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    with pytest.raises(ConfigError, match="--no-figures") as caught:
        draw(reproduction, blocked / "figures")
    assert str(blocked) in str(caught.value)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_draw_says_so_when_the_disk_is_full(reproduction: Reproduction, tmp_path: Path) -> None:
    (tmp_path / "figure-1-state.png").symlink_to("/dev/full")
    with pytest.raises(ConfigError, match=r"No space left on device\. Choose another folder with --out"):
        draw(reproduction, tmp_path)


def test_draw_names_the_package_when_matplotlib_is_missing(
    reproduction: Reproduction, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ConfigError, match=r"pip install matplotlib"):
        draw(reproduction, tmp_path)
    assert list(tmp_path.iterdir()) == []
