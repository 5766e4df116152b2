"""The picture of a reversal: the script draws it, every observer is on it, and the page shows it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.image import imread

from dcmp_hil.config.rig import KINDS
from dcmp_hil.telemetry.signals import ESTIMATE_RGB, TRUE_RGB
from tools.nominal_ride import ride, rig_with
from tools.reversal import CLOSED_BY, PICTURE, reversal

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ROOT = Path(__file__).parents[2]


def _pixels(path: Path) -> NDArray[np.float64]:
    return np.asarray(imread(str(path)), float)[..., :3]


def _coloured(picture: NDArray[np.float64], rgb: tuple[int, int, int]) -> int:
    return int((np.abs(picture - np.array(rgb) / 255).max(axis=-1) < 0.02).sum())


def test_the_script_draws_a_light_picture_that_is_wide_enough_to_read(tmp_path: Path) -> None:
    path = tmp_path / "new" / "reversal.png"
    subprocess.run([sys.executable, "-m", "tools.reversal", str(path)], check=True, cwd=_ROOT)
    drawn, shown = _pixels(path), _pixels(PICTURE)
    assert drawn.shape == shown.shape
    assert drawn.shape[1] == 1200
    for picture in (drawn, shown):
        assert np.median(picture) == 1.0
        assert min(_coloured(picture, rgb) for rgb in (TRUE_RGB, ESTIMATE_RGB)) > 10_000
    assert (np.abs(drawn - shown).max(axis=-1) > 0.5).mean() < 0.01  # another font moves the labels


def test_every_observer_sees_the_same_reversal() -> None:
    found = reversal()
    assert set(found.seen) == set(KINDS["observer"]) - {"custom"}
    before, after = (found.disturbance[found.time < 0.0][-1], found.disturbance[found.time >= 0.0][1:9])
    jump = 2.0 * rig_with(CLOSED_BY).model.f1_rad_s2
    assert before - after.min() == pytest.approx(jump, abs=0.05)
    errors = {kind: float(np.abs(seen.velocity_error).max()) for kind, seen in found.seen.items()}
    assert errors["friction_kalman"] < 0.1 * errors["super_twisting"] < 0.1 * errors["paper"]


def test_the_observer_that_closes_the_loop_sees_what_its_run_recorded() -> None:
    columns, found = ride(CLOSED_BY, 12.0), reversal()
    recorded = columns["disturbance_estimate_rad_s2"].tolist()
    seen = found.seen[CLOSED_BY].disturbance.tolist()
    start = recorded.index(seen[0])
    assert recorded[start : start + len(seen)] == seen


def test_the_page_shows_the_picture_and_names_its_target() -> None:
    page = (_ROOT / "docs" / "observers.md").read_text("utf-8")
    assert f"](images/{PICTURE.name})" in page
    assert "`make reversal`" in page
