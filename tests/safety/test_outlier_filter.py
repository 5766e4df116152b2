"""Wrong counts: one is left out, the third ends the run, and other oddities are not the filter's."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.safety.outlier_filter import OutlierFilter
from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.values import Estimate, Sample
from tests.helpers import T

COUNT_RAD = math.tau / 4096
SPEED_RAD_S = 20.0  # rad/s: four times that is 0.08 rad a period


class _Bench:
    def __init__(self, speed: float = SPEED_RAD_S) -> None:
        self.outliers = OutlierFilter(speed, T, COUNT_RAD)

    @property
    def stop(self) -> TripRequest | None:
        return self.outliers.check(Sample(0.0, 0.0, 0.0), Estimate(0.0, 0.0, 0.0))

    def rejected(self, *positions: float, step: float = T, begin: float = 0.0) -> list[bool]:
        """Show positions a period apart."""
        return [
            self.outliers.reject(Sample(begin + k * step, position, 0.0))
            for k, position in enumerate(positions)
        ]


@pytest.mark.parametrize("jump", [0.081, -0.3, 1e6])
def test_outliers_leave_one_wrong_count_out(jump: float) -> None:
    bench = _Bench()
    assert bench.rejected(1.0, 1.0, 1.0 + jump, 1.0, 1.0) == [False, False, True, False, False]
    assert bench.outliers.count == 1
    assert bench.stop is None


def test_outliers_are_not_how_fast_an_arm_can_turn() -> None:
    bench = _Bench()
    assert not any(bench.rejected(*(0.079 * k for k in range(100))))


def test_outliers_allow_for_lost_samples() -> None:
    bench = _Bench()
    assert not any(bench.rejected(0.0, 0.7, step=9 * T))
    assert bench.rejected(0.81, step=T, begin=10 * T) == [True]


def test_outliers_know_how_coarse_the_encoder_is() -> None:
    bench = _Bench(speed=1.0)  # 4 mrad a period, less than three counts
    assert bench.rejected(0.0, 7.9 * COUNT_RAD, 0.0, 8.1 * COUNT_RAD) == [False, False, False, True]


def test_third_outlier_within_a_hundred_samples_ends_the_run() -> None:
    for between, ends in ((96, True), (97, False)):
        bench = _Bench()
        seen = bench.rejected(0.0, 1.0, 0.0, 1.0, *[0.0] * between, 1.0)
        assert seen.count(True) == (2 if ends else 3)
        assert (bench.stop is not None and bench.stop.reason == "jump") == ends


def test_jump_that_stays_ends_the_run_with_its_third_sample() -> None:
    bench = _Bench()
    assert bench.rejected(0.0, 1.0, 1.0, 1.0) == [False, True, True, False]
    assert bench.stop is not None
    assert (bench.stop.reason, bench.stop.urgency) == ("jump", Urgency.NOW)
    assert "t = 0.003 s" in bench.stop.sentence


@pytest.mark.parametrize("position", [math.nan, math.inf, -math.inf])
def test_outliers_leave_what_is_no_number_to_the_monitors(position: float) -> None:
    assert _Bench().rejected(0.0, position) == [False, False]


def test_outliers_never_hide_a_fault_of_the_device() -> None:
    bench = _Bench()
    bench.rejected(0.0)
    assert not bench.outliers.reject(Sample(T, 3.0, 0.0, 5))


def test_outliers_find_none_without_a_limit() -> None:
    assert not any(_Bench(speed=math.inf).rejected(0.0, 1e9, -1e9))
