"""Monitors: limits at the very edge, and NaN that always fails closed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.assembly import make_supervisor
from dcmp_hil.errors import TripError
from dcmp_hil.safety.monitors import DisturbanceWatch, FiniteMonitor, RangeMonitor
from dcmp_hil.values import Estimate, Fault, Sample
from tests.helpers import T, bench, setting, spoilt

if TYPE_CHECKING:
    from dcmp_hil.trip_request import Check

_SAMPLE, _ESTIMATE = Sample(1.0, 0.1, 2.0), Estimate(0.1, 0.5, -3.0)
_NOT_FINITE = [math.nan, math.inf, -math.inf]


def _reason(monitor: Check, sample: Sample = _SAMPLE, estimate: Estimate = _ESTIMATE) -> str:
    """Return why the monitor objects; empty if it does not."""
    stop = monitor.check(sample, estimate)
    if stop is None:
        return ""
    trip = stop.error()
    assert isinstance(trip, TripError)
    return trip.explained().reason


class _Finds:
    """An observer that finds the same disturbance every time."""

    def __init__(self, w: float) -> None:
        self.w = w
        self.velocity = 0.0

    def update(self, sample: Sample) -> Estimate:
        return Estimate(sample.position, self.velocity, self.w)


def test_finite_lets_a_healthy_period_pass() -> None:
    assert _reason(FiniteMonitor()) == ""


@pytest.mark.parametrize("bad", _NOT_FINITE)
@pytest.mark.parametrize("field", ["t", "position", "voltage"])
def test_finite_objects_when_a_number_of_the_sample_is_not_finite(field: str, bad: float) -> None:
    assert _reason(FiniteMonitor(), sample=spoilt(_SAMPLE, field, bad)) == "not_finite"


@pytest.mark.parametrize("bad", _NOT_FINITE)
@pytest.mark.parametrize("field", Estimate._fields)
def test_finite_objects_when_a_number_of_the_estimate_is_not_finite(field: str, bad: float) -> None:
    assert _reason(FiniteMonitor(), estimate=_ESTIMATE._replace(**{field: bad})) == "not_finite"


def test_finite_objects_when_infinities_would_cancel() -> None:
    both = Estimate(math.inf, -math.inf, 0.0)
    assert _reason(FiniteMonitor(), estimate=both) == "not_finite"


@pytest.mark.parametrize("code", [Fault.UNKNOWN, 1, 77])
def test_finite_objects_when_the_device_reports_a_fault(code: int) -> None:
    assert _reason(FiniteMonitor(), sample=_SAMPLE._replace(fault=code)) == "device_fault"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ranges_object_just_beyond_the_limit_and_not_on_it(sign: float) -> None:
    ranges = RangeMonitor(position=6.0, velocity=20.0)
    beyond = math.nextafter
    assert _reason(ranges, sample=_SAMPLE._replace(position=sign * 6.0)) == ""
    assert _reason(ranges, sample=_SAMPLE._replace(position=beyond(sign * 6.0, sign * 9))) == "travel"
    assert _reason(ranges, estimate=_ESTIMATE._replace(velocity=sign * 20.0)) == ""
    assert _reason(ranges, estimate=_ESTIMATE._replace(velocity=beyond(sign * 20.0, sign * 99))) == "speed"


def test_ranges_leave_an_estimate_what_the_encoder_shows_too_much() -> None:
    ranges = RangeMonitor(position=6.0, velocity=2.0, spare=0.25)
    for velocity, reason in ((2.25, ""), (-2.25, ""), (2.26, "speed"), (-2.26, "speed")):
        assert _reason(ranges, estimate=_ESTIMATE._replace(velocity=velocity)) == reason


def test_limits_are_judged_by_the_watch_and_not_by_the_run_s_observer() -> None:
    observer = _Finds(0.0)
    watch = DisturbanceWatch(observer, setting(), 50.0, ranges=RangeMonitor(6.0, 2.0, seen_by="the watch"))
    assert _reason(watch, estimate=Estimate(0.0, 99.0, 0.0)) == ""
    observer.velocity = -2.1
    assert _reason(watch, estimate=Estimate(0.0, 0.0, 0.0)) == "speed"
    observer.velocity = math.nan
    assert _reason(watch, estimate=Estimate(0.0, 0.0, 0.0)) == "speed"


@pytest.mark.parametrize("bad", _NOT_FINITE)
def test_ranges_object_when_what_they_watch_is_not_finite(bad: float) -> None:
    ranges = RangeMonitor(position=6.0, velocity=20.0)
    assert _reason(ranges, sample=_SAMPLE._replace(position=bad)) == "travel"
    assert _reason(ranges, estimate=_ESTIMATE._replace(velocity=bad)) == "speed"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_disturbance_watch_objects_after_five_milliseconds_above_the_limit(sign: float) -> None:
    # First order over 10 ms from 0 towards 100 rad/s2: 100 (1 - exp(-k/10)) passes 50 after ln 2 x 10
    # = 6.93 periods of 1 ms, so period 7 is the first above, and 7, 8, 9, 10, 11 are five in a row.
    watch = DisturbanceWatch(_Finds(sign * 100.0), setting(), 50.0)
    reasons = [_reason(watch) for _ in range(11)]
    assert reasons == [""] * 10 + ["disturbance"]


def test_disturbance_watch_passes_when_the_limit_is_reached_and_not_exceeded() -> None:
    watch = DisturbanceWatch(_Finds(50.0), setting(), 50.0)
    assert {_reason(watch) for _ in range(5000)} == {""}  # it approaches 50 rad/s2 from below


def test_disturbance_watch_forgives_a_short_peak() -> None:
    observer = _Finds(100.0)
    watch = DisturbanceWatch(observer, setting(), 50.0)
    for _ in range(10):  # four periods above the limit, as computed above
        assert _reason(watch) == ""
    observer.w = -1000.0  # pulls the mean below the limit in one period
    assert _reason(watch) == ""
    # It is at -1000 + 1063.2 exp(-0.1) = -38 now, and 100 - 138 exp(-k/10) passes 50 with k = 11: the four
    # periods of before must not count, so k = 15 is the fifth.
    observer.w = 100.0
    assert [_reason(watch) for _ in range(15)] == [""] * 14 + ["disturbance"]


@pytest.mark.parametrize("bad", _NOT_FINITE)
def test_disturbance_watch_objects_at_once_when_its_estimate_is_nan(bad: float) -> None:
    watch = DisturbanceWatch(_Finds(0.0), setting(), 50.0)
    assert _reason(watch) == ""
    watch = DisturbanceWatch(_Finds(math.nan), setting(), 50.0)
    assert _reason(watch) == "disturbance"
    watch = DisturbanceWatch(_Finds(bad), setting(), 50.0)
    assert "disturbance" in [_reason(watch) for _ in range(5)]


@pytest.mark.parametrize("bad", _NOT_FINITE)
@pytest.mark.parametrize("field", ["t", "position", "voltage", *(f"estimate.{f}" for f in Estimate._fields)])
@pytest.mark.parametrize("monitors", ["all", "finite"])
def test_the_rigs_monitors_trip_in_the_same_period_when_anything_is_not_finite(
    monitors: str, field: str, bad: float
) -> None:
    # safety.md, S01: A2 in the same tick
    supervisor = make_supervisor(
        bench("supervisor.start=immediate", f"supervisor.monitors={monitors}"), lambda _: None
    )
    for k in range(5):
        sample = Sample(k * T, 0.1, 0.0)
        supervisor.engages(sample)
        assert supervisor.safe_voltage(sample, Estimate(0.1, 0.0, 0.0), 1.0) == 1.0
    sample, estimate = Sample(5 * T, 0.1, 0.0), Estimate(0.1, 0.0, 0.0)
    if field.startswith("estimate."):
        estimate = estimate._replace(**{field.removeprefix("estimate."): bad})
    else:
        sample = spoilt(sample, field, bad)
    assert supervisor.safe_voltage(sample, estimate, 1.0) == 0.0
    over = supervisor.over
    assert over is not None
    assert (over.reason, over.orderly) == ("not_finite", False)


@pytest.mark.parametrize(
    ("key", "sample", "estimate", "reason"),
    [
        ("velocity_limit_rad_s=3.0", Sample(0.0, 0.0, 0.0), Estimate(0.0, 3.2, 0.0), "speed"),
        ("position_limit_rad=1.0", Sample(0.0, -1.1, 0.0), Estimate(0.0, 0.0, 0.0), "travel"),
    ],
)
def test_the_rigs_limits_reach_the_monitors(
    key: str, sample: Sample, estimate: Estimate, reason: str
) -> None:
    for overrides, expected in (((f"supervisor.{key}",), reason), ((), None)):
        supervisor = make_supervisor(bench(*overrides), lambda _: None)
        supervisor.safe_voltage(sample, estimate, 0.0)
        assert getattr(supervisor.over, "reason", None) == expected
