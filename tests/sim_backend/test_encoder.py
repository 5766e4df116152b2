"""The encoder: counts, phase, noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_backend.encoder import Encoder

_COUNT_RAD = 2.0 * math.pi / 4096  # rad


def _encoder(
    counts: float | None = 4096.0, *, phase: float = 0.0, noise: float = 0.0, seed: int = 1
) -> Encoder:
    return Encoder(counts, phase=phase, noise=noise, seed=seed)


@given(position=st.floats(-50.0, 50.0), phase=st.floats(0.0, 1.0, exclude_max=True))
def test_encoder_errs_by_half_a_count_at_most(position: float, phase: float) -> None:
    assert abs(_encoder(phase=phase).read(position) - position) <= 0.5 * _COUNT_RAD * (1 + 1e-9)


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, 1.0, exclude_max=True))
def test_encoder_moves_by_whole_counts(one: float, other: float, phase: float) -> None:
    encoder = _encoder(phase=phase)
    counts = (encoder.read(one) - encoder.read(other)) / _COUNT_RAD
    assert counts == pytest.approx(round(counts), abs=1e-8)


@pytest.mark.parametrize("phase", [0.0, 0.1, 0.25, 0.5, 0.77, 0.99])
def test_encoder_has_no_mean_error_at_any_phase(phase: float) -> None:
    encoder = _encoder(phase=phase)
    positions = (np.arange(10_000) + 0.5) / 10_000 * 7 * _COUNT_RAD - 3.3 * _COUNT_RAD  # seven whole counts
    mean = np.mean([encoder.read(float(x)) - x for x in positions])
    assert abs(mean) < 1e-3 * _COUNT_RAD


def test_encoder_phase_moves_the_edges() -> None:
    # With phase p the edges lie at (n + 1/2 - p) counts.
    for phase in (0.0, 0.3, 0.8):
        encoder, edge = _encoder(phase=phase), (0.5 - phase) * _COUNT_RAD
        assert encoder.read(edge + 1e-9) - encoder.read(edge - 1e-9) == pytest.approx(_COUNT_RAD)


def test_encoder_shows_the_very_position_when_ideal() -> None:
    assert _encoder(None, phase=0.4).read(0.123456789) == 0.123456789


@pytest.mark.parametrize(("counts", "unit"), [(4096.0, _COUNT_RAD), (None, 1.0)])
def test_encoder_noise_has_its_deviation_and_repeats_by_seed(counts: float | None, unit: float) -> None:
    readings = []
    for seed in (1, 1, 2):
        encoder = _encoder(counts, noise=3.0, seed=seed)
        readings.append(np.array([encoder.read(0.7) for _ in range(4000)]))
    assert (readings[0] == readings[1]).all()
    assert (readings[0] != readings[2]).any()
    quantised = 0.0 if counts is None else 1 / 12  # variance of the rounding, counts^2
    assert readings[0].std() / unit == pytest.approx(math.sqrt(9.0 + quantised), rel=0.05)
    assert readings[0].mean() == pytest.approx(0.7, abs=0.2 * unit)
