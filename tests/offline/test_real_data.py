"""Recordings of a real pendulum, where they are at hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from dcmp_hil.offline import Figures, ReplaySettings, read_recording, replay

DATA = Path(__file__).resolve().parents[2] / ".." / "shared" / "data" / "dfki_pendulum"
INERTIA_KG_M2 = 0.16  # kg m2

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the measured data is not at ../shared/data")


def figures_of(name: str, **settings: object) -> Figures:
    recording = read_recording(DATA / name)
    return replay(recording, ReplaySettings(inertia=INERTIA_KG_M2, **settings)).figures  # type: ignore[arg-type]


def test_velocity_is_at_least_as_good_as_the_drives_own_on_the_swing_up() -> None:
    figures = figures_of("swingup_333hz.csv")
    assert figures.given_velocity_error_rms_rad_s == pytest.approx(0.143, abs=0.002)
    assert figures.given_velocity_error_rms_rad_s is not None
    assert figures.velocity_error_rms_rad_s <= figures.given_velocity_error_rms_rad_s
    assert figures.velocity_error_rms_rad_s == pytest.approx(0.14, abs=0.02)
    assert figures.disturbance_sin_correlation is not None
    assert figures.disturbance_sin_correlation > 0.97
    assert figures.counts_per_rev == pytest.approx(2156, abs=1)
    assert figures.lost_samples == 0


def test_velocity_is_far_better_than_the_drives_own_where_that_is_off() -> None:
    figures = figures_of("identification_300hz.csv")
    assert figures.given_velocity_error_rms_rad_s == pytest.approx(1.97, abs=0.05)
    assert figures.velocity_error_rms_rad_s < 0.25
    assert figures.disturbance_sin_correlation is not None
    assert figures.disturbance_sin_correlation > 0.95
