"""The figures of a run against numpy on the whole of it, however it is cut into blocks."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.statistics import BOUNDS_US, DurationHistogram, Durations, Statistics, Summary

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_T = 1e-3  # s


def _run(
    seed: int, n: int, *, true: bool = True
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.float64]]:
    """Draw `n` periods: columns by field, and the reference."""
    random = np.random.default_rng(seed)
    columns = {name: random.normal(size=n) for name in FIELDS}
    columns["t"] = np.asarray(_T * np.arange(n), np.float64)
    columns["period"] = _T * random.lognormal(0.0, 0.3, size=n)
    columns["lateness"] = 4e-4 * random.lognormal(size=n)
    columns["period"][0] = math.nan  # the first has none
    if not true:
        for name in ("position_true", "velocity_true", "disturbance_true"):
            columns[name][:] = math.nan
    return columns, random.normal(size=(n, 3))


def _figures(
    columns: dict[str, NDArray[np.float64]],
    reference: NDArray[np.float64],
    cuts: Sequence[int],
    window: tuple[float, float] = (0.0, math.inf),
) -> Summary:
    rows = np.column_stack([columns[name] for name in FIELDS])
    rows[:, FIELDS.index("position_reference") : FIELDS.index("acceleration_reference") + 1] = reference
    rows[:, FIELDS.index("began")] = -math.inf
    statistics = Statistics(_T, *window)
    edges = [0, *sorted(min(cut, len(rows)) for cut in cuts), len(rows)]
    for first, last in itertools.pairwise(edges):
        statistics.block(Block(rows[first:last]))
    return statistics.summary(7.0)


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


_cuts = st.lists(st.integers(0, 700), max_size=12)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 700), cuts=_cuts, start=st.integers(0, 800))
def test_statistics_equal_numpy_when_the_run_comes_in_blocks(
    seed: int, n: int, cuts: list[int], start: int
) -> None:
    columns, reference = _run(seed, n)
    got = _figures(columns, reference, cuts, window=(start * _T, math.inf))
    c = {name: column[start:] for name, column in columns.items()}
    tracking = c["position_true"] - reference[start:, 0]
    velocity = c["velocity_estimate"] - c["velocity_true"]
    if start >= n:
        assert got.periods == 0
        assert got.tracking_rms_rad is None
        assert got.voltage_peak_V is None
        assert math.isnan(got.lateness_us.p50)
        return
    assert got.tracking_rms_rad == pytest.approx(_rms(tracking), rel=1e-12, abs=0.0)
    assert got.tracking_max_rad == pytest.approx(np.abs(tracking).max(), rel=1e-12, abs=0.0)
    assert got.velocity_error_rms_rad_s == pytest.approx(_rms(velocity), rel=1e-12, abs=0.0)
    assert got.velocity_error_max_rad_s == pytest.approx(np.abs(velocity).max(), rel=1e-12, abs=0.0)
    disturbance = c["disturbance_estimate"] - c["disturbance_true"]
    assert got.disturbance_error_rms_rad_s2 == pytest.approx(_rms(disturbance), rel=1e-12, abs=0.0)
    assert got.voltage_peak_V == pytest.approx(np.abs(c["voltage_sent"]).max(), rel=1e-12, abs=0.0)
    if n - start > 1:  # sum|dV| a second, between the first and the last sample of the window
        span = _T * (n - start - 1)
        variation = np.abs(np.diff(c["voltage_sent"])).sum() / span
        assert got.voltage_tv_V_s == pytest.approx(variation, rel=1e-9)
    else:
        assert got.voltage_tv_V_s is None
    assert got.periods == n - start
    assert got.late_periods == int((c["lateness"] > 0.5 * _T).sum())
    assert got.realtime_factor == 7.0
    assert got.window_s == pytest.approx((start * _T, n * _T))


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 3000), cuts=_cuts)
def test_durations_are_right_to_one_percent(seed: int, n: int, cuts: list[int]) -> None:
    # Between the neighbouring ranks of a sort, give or take 1 %; the maximum is exact (to 1 ns).
    random = np.random.default_rng(seed)
    values = 10.0 ** random.uniform(-7.9, 2.9, size=n)  # s, from 13 ns to 800 s
    durations = Durations()
    for piece in np.split(values, sorted(min(cut, n) for cut in cuts)):
        durations.add(piece)
    got, ordered = durations.percentiles(), 1e6 * np.sort(values)
    for quantile, value in ((0.5, got.p50), (0.99, got.p99), (0.999, got.p999)):
        rank = math.ceil(round(quantile * n, 9)) - 1
        low, high = ordered[max(rank - 1, 0)], ordered[min(rank + 1, n - 1)]
        assert 0.99 * low - 1e-3 <= value <= 1.01 * high + 1e-3
    assert got.max == pytest.approx(ordered[-1], abs=1e-3)


def test_durations_agree_with_numpy_when_there_are_many() -> None:
    values = np.random.default_rng(5).lognormal(-7.0, 0.8, size=200_000)
    durations = Durations()
    durations.add(values)
    got = durations.percentiles()
    expected = 1e6 * np.quantile(values, [0.5, 0.99, 0.999], method="inverted_cdf")
    assert [got.p50, got.p99, got.p999] == pytest.approx(expected.tolist(), rel=0.01)


def test_durations_clip_what_is_early_or_exactly_on_time() -> None:
    durations = Durations()
    durations.add(np.array([math.nan, -2e-3, 0.0, 0.0]))
    got = durations.percentiles()
    assert got.max == 0.0
    assert got.p50 <= 0.0
    assert not durations.counts.sum() > 3, "NaN is no duration"


def test_a_histogram_counts_every_duration_once_between_its_bounds() -> None:
    seconds = 1e-6 * np.array([0.0, -3.0, 0.3, 1.7, 4.0, 4.9, 30.0, 30.0, 2e6, math.nan])
    durations = Durations()
    for piece in np.split(seconds, 5):
        durations.add(piece)
    found = durations.histogram()
    assert found.up_to_us == (*BOUNDS_US, math.inf)
    counts = dict(zip(found.up_to_us, found.counts, strict=True))
    assert {bound: n for bound, n in counts.items() if n} == {1.0: 3, 2.0: 1, 5.0: 2, 50.0: 2, math.inf: 1}


def test_a_histogram_shows_no_empty_ends() -> None:
    durations = Durations()
    assert durations.histogram() == DurationHistogram((), ())
    durations.add(1e-6 * np.array([30.0, 300.0]))
    assert durations.histogram() == DurationHistogram((50.0, 100.0, 200.0, 500.0), (1, 0, 0, 1))


def test_statistics_measure_tracking_when_no_truth_is_known() -> None:
    columns, reference = _run(3, 400, true=False)
    got = _figures(columns, reference, [100])
    assert got.tracking_rms_rad == pytest.approx(_rms(columns["position"] - reference[:, 0]), rel=1e-12)
    assert got.velocity_error_rms_rad_s is None
    assert got.velocity_error_max_rad_s is None
    assert got.disturbance_error_rms_rad_s2 is None


def test_statistics_leave_out_the_periods_whose_truth_is_not_known_yet() -> None:
    columns, reference = _run(4, 50)
    columns["disturbance_true"][0] = math.nan  # before the first step of the plant
    got = _figures(columns, reference, [])
    error = (columns["disturbance_estimate"] - columns["disturbance_true"])[1:]
    assert got.disturbance_error_rms_rad_s2 == pytest.approx(_rms(error), rel=1e-12)


def test_statistics_end_before_the_windows_end() -> None:
    columns, reference = _run(6, 300)
    got = _figures(columns, reference, [50, 180], window=(0.1, 0.2))
    assert got.periods == 100
    assert got.window_s == pytest.approx((0.1, 0.2))
    assert got.tracking_rms_rad == pytest.approx(
        _rms((columns["position_true"] - reference[:, 0])[100:200]), rel=1e-12
    )


def test_statistics_have_no_figures_when_nothing_ran() -> None:
    got = Statistics(_T, 2.0).summary(math.nan)
    assert got.periods == got.late_periods == 0
    assert got.tracking_max_rad is None
    assert got.voltage_tv_V_s is None
    assert got.window_s == (2.0, 2.0)


def test_statistics_tell_what_a_command_takes_and_how_fast_the_clocks_part() -> None:
    columns, reference = _run(1, 1000)
    columns["compute"] = np.linspace(10e-6, 20e-6, 1000)
    columns["lateness"] = 250e-6 * columns["t"]  # a device whose clock is 250 ppm slow
    got = _figures(columns, reference, [300, 600], window=(0.1, 0.9))
    assert got.compute_us.p50 == pytest.approx(15.0, rel=0.01)
    assert got.compute_us.max == pytest.approx(19.0, rel=0.001)
    assert got.rate_error_ppm == pytest.approx(250.0)
