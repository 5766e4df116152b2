"""The supervisor: phases in order, authority, clamp, and the first cause that wins."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.safety.limiter import Limiter
from dcmp_hil.safety.supervisor import Phase, Supervisor
from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.values import Estimate, Event, EventKind, Reference, Sample

_ANY, _AT_REST = Sample(0.0, 0.0, 0.0), Estimate(0.0, 0.0, 0.0)
_PERIOD_S = 1.0 / 1024.0  # s, exact in binary: phases change at the very period


class _Objects:
    def __init__(self, at: float, reason: str = "because") -> None:
        self.at, self._reason = at, reason

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:  # noqa: ARG002
        return TripRequest(self._reason, "Seen.", "Look.") if sample.t >= self.at else None


def _supervisor(
    *monitors: _Objects,
    limit: float = 10.0,
    settle: float = 0.25,
    engage: float = 0.25,
    slew: float = math.inf,
) -> tuple[Supervisor, list[Event]]:
    events: list[Event] = []
    limiter = Limiter(voltage=limit, slew=slew, period=_PERIOD_S, notify=events.append)
    made = Supervisor(monitors, limiter, settle=settle, engage=engage, notify=events.append)
    return made, events


def _objection(limiter: Limiter) -> TripRequest | None:
    return limiter.objection


def _reason(supervisor: Supervisor) -> str:
    over = supervisor.over
    assert over is not None
    return over.reason


def _period(supervisor: Supervisor, t: float, demand: float) -> tuple[bool, float]:
    sample = Sample(t, 0.0, 0.0)
    engages = supervisor.engages(sample)
    return engages, supervisor.safe_voltage(sample, _AT_REST, demand)


def test_supervisor_goes_through_its_phases_in_order() -> None:
    supervisor, events = _supervisor()
    begun = []
    for k in range(1024):
        engages, voltage = _period(supervisor, 5.0 + k * _PERIOD_S, 1e6)
        if engages:
            begun.append(k)
        if k < 256:
            assert voltage == 0.0
        elif k < 512:  # a ramp from 0 to 10 V
            assert voltage == pytest.approx(10.0 * (k - 256) / 256, abs=1e-9)
        else:
            assert voltage == 10.0
    assert begun == [256]
    phases = [(event.t, event.text) for event in events if event.kind is EventKind.PHASE]
    assert phases == [(5.0, "settling"), (5.25, "engaging"), (5.5, "running")]
    assert supervisor.phase is Phase.RUNNING


def test_supervisor_has_full_authority_at_once_when_immediate() -> None:
    supervisor, _ = _supervisor(settle=0.0, engage=0.0)
    assert _period(supervisor, 0.0, 7.0) == (True, 7.0)
    assert supervisor.phase is Phase.RUNNING
    assert _period(supervisor, _PERIOD_S, 7.0) == (False, 7.0)


def test_supervisor_counts_seconds_not_samples_when_some_are_lost() -> None:
    supervisor, _ = _supervisor()
    assert _period(supervisor, 0.0, 1.0) == (False, 0.0)
    assert _period(supervisor, 0.3, 1.0) == (True, 0.0)
    assert _period(supervisor, 0.425, 9.0)[1] == pytest.approx(5.0)
    assert _period(supervisor, 0.55, 9.0) == (False, 9.0)


@given(limit=st.floats(0.1, 100.0), demand=st.floats(allow_nan=False, allow_infinity=False))
def test_supervisor_never_lets_more_than_the_limit_through(limit: float, demand: float) -> None:
    supervisor, _ = _supervisor(limit=limit, settle=0.0, engage=0.0)
    _, voltage = _period(supervisor, 0.0, demand)
    assert voltage == max(-limit, min(limit, demand))
    assert supervisor.limiter.clamped == (abs(demand) > limit)


@pytest.mark.parametrize("demand", [10.0, -10.0])
def test_supervisor_does_not_call_the_limit_itself_clamped(demand: float) -> None:
    supervisor, events = _supervisor(settle=0.0, engage=0.0)
    assert _period(supervisor, 0.0, demand)[1] == demand
    assert supervisor.limiter.clamped == 0
    assert not [event for event in events if event.level == "WARN"]


def test_supervisor_says_it_once_a_second_when_it_clamps() -> None:
    supervisor, events = _supervisor(settle=0.0, engage=0.0)
    for k in range(3 * 1024):
        _period(supervisor, k * _PERIOD_S, 11.0 if k % 256 > 3 else 0.0)  # in a row it would end the run
    warnings = [event.t for event in events if event.level == "WARN"]
    assert warnings == [4 * _PERIOD_S, 1.0 + 4 * _PERIOD_S, 2.0 + 4 * _PERIOD_S]
    assert supervisor.limiter.clamped == 3 * (1024 - 16)


def test_supervisor_is_silent_when_the_growing_limit_bites() -> None:
    supervisor, events = _supervisor()
    for k in range(512):
        _period(supervisor, k * _PERIOD_S, 1.0)
    assert supervisor.limiter.clamped == 0
    assert {event.kind for event in events} == {EventKind.PHASE}


def test_supervisor_lets_everything_through_when_there_is_no_limit() -> None:
    supervisor, _ = _supervisor(limit=math.inf)
    voltages = [_period(supervisor, k * _PERIOD_S, 1175.0)[1] for k in range(1024)]
    assert all(math.isfinite(voltage) for voltage in voltages), "infinity x 0 is no voltage"
    assert voltages[:256] == [0.0] * 256
    assert voltages[512:] == [1175.0] * 512


def test_supervisor_stays_at_zero_volts_once_a_monitor_objected() -> None:
    monitor = _Objects(1.0)
    supervisor, _ = _supervisor(monitor, settle=0.0, engage=0.0)
    assert _period(supervisor, 0.9, 3.0)[1] == 3.0
    assert _period(supervisor, 1.0, 3.0)[1] == 0.0
    monitor.at = math.inf  # the fault is gone
    assert _period(supervisor, 1.1, 3.0)[1] == 0.0
    assert supervisor.over is not None


def test_supervisor_keeps_the_first_cause() -> None:
    supervisor, _ = _supervisor(_Objects(1.0, "second"), _Objects(0.5, "first"), settle=0.0, engage=0.0)
    for t in (0.4, 0.6, 1.2):
        _period(supervisor, t, math.nan if t > 1.0 else 1.0)
    assert _reason(supervisor) == "first"


@pytest.mark.parametrize("demand", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("settle", [0.0, 0.25])
def test_supervisor_trips_when_the_demand_is_not_finite(demand: float, settle: float) -> None:
    supervisor, _ = _supervisor(settle=settle)
    assert _period(supervisor, 0.0, demand)[1] == 0.0
    assert _reason(supervisor) == "not_finite"


def test_supervisor_trips_while_it_settles_too() -> None:
    supervisor, _ = _supervisor(_Objects(0.1))
    for t in (0.0, 0.1):
        _period(supervisor, t, 0.0)
    assert supervisor.over is not None


def _reasons_of(supervisor: Supervisor, demand: float, seconds: float) -> list[tuple[float, float]]:
    """Run periods until it trips; return device times and voltages."""
    seen: list[tuple[float, float]] = []
    while supervisor.over is None and len(seen) < seconds / _PERIOD_S:
        t = len(seen) * _PERIOD_S
        seen.append((t, _period(supervisor, t, demand)[1]))
    return seen


def test_supervisor_ends_in_an_orderly_way_when_the_voltage_is_limited_for_half_a_second() -> None:
    # P03: 500 ms saturated: A1, that is to 0 V within 50 ms
    supervisor, events = _supervisor(settle=0.0, engage=0.0)
    seen = _reasons_of(supervisor, 11.0, 2.0)
    assert _reason(supervisor) == "saturation"
    assert abs(seen[-1][0] - 0.55) <= 2 * _PERIOD_S
    assert seen[-1][1] == 0.0
    ramp = [voltage for t, voltage in seen if t >= 0.5]
    assert ramp == pytest.approx([10.0 * (1.0 - k * _PERIOD_S / 0.05) for k in range(len(ramp) - 1)] + [0.0])
    assert [event.text for event in events if event.kind is EventKind.PHASE][-2:] == ["stopping", "tripped"]


def test_supervisor_goes_to_zero_at_once_when_a_fault_comes_into_an_orderly_end() -> None:
    supervisor, _ = _supervisor(_Objects(0.52), settle=0.0, engage=0.0)
    seen = _reasons_of(supervisor, 11.0, 2.0)
    assert seen[-1][0] == pytest.approx(0.52, abs=_PERIOD_S)
    assert seen[-2][1] > 5.0
    assert seen[-1][1] == 0.0
    assert _reason(supervisor) == "saturation"  # the first cause wins


@pytest.mark.parametrize("demand", [0.0, 3.0, -3.0, 20.0])
def test_supervisor_lets_no_more_through_than_at_first_while_it_stops(demand: float) -> None:
    supervisor, _ = _supervisor(settle=0.0, engage=0.0)
    assert _period(supervisor, 0.0, -6.0)[1] == -6.0
    supervisor.stop(TripRequest("late", "Seen.", "Look.", Urgency.RAMP), 0.0)
    assert supervisor.over is None
    assert supervisor.stopping
    for k in range(1, 60):
        most = 6.0 * max(0.0, 1.0 - (k * _PERIOD_S) / 0.05)
        assert _period(supervisor, k * _PERIOD_S, demand)[1] == pytest.approx(max(-most, min(most, demand)))
    assert _reason(supervisor) == "late"
    assert not supervisor.stopping


def test_supervisor_trips_at_once_when_an_orderly_end_is_asked_for_without_authority() -> None:
    supervisor, _ = _supervisor()
    _period(supervisor, 0.0, 1.0)
    supervisor.stop(TripRequest("late", "Seen.", "Look.", Urgency.RAMP), 0.0)
    assert _reason(supervisor) == "late"


def test_supervisor_limits_the_slew_in_every_phase() -> None:
    supervisor, events = _supervisor(slew=100.0)
    last = 0.0
    for k in range(1024):
        voltage = _period(supervisor, k * _PERIOD_S, 9.0 if k % 200 < 100 else -9.0)[1]
        assert abs(voltage - last) <= 100.0 * _PERIOD_S + 1e-12
        last = voltage
    said = [event.text for event in events if event.level == "WARN"]
    assert said
    assert said[0].startswith("slew limited")


def _bound(limiter: Limiter, reference: Reference, t: float = 0.0, position: float = 0.0) -> Reference:
    return limiter.limit_reference(Sample(t, position, 0.0), reference)


def test_limits_hold_the_reference_short_of_where_the_supervisor_trips() -> None:
    events: list[Event] = []
    limiter = Limiter(voltage=10.0, period=_PERIOD_S, notify=events.append, position=1.9, velocity=9.5)
    inside = Reference(1.9, -0.1, 40.0)
    assert _bound(limiter, inside) is inside
    assert not events
    assert abs(_bound(limiter, Reference(-2.5, -1.0, 3.0), t=_PERIOD_S).position) <= 1.9
    assert abs(_bound(limiter, Reference(1.0, 12.0, 3.0), t=2 * _PERIOD_S).velocity) <= 9.5
    assert [event.text for event in events] == [
        "reference limited to 1.9 rad: it asks for -2.5",
        "reference's velocity limited to 9.5 rad/s: it asks for 12",
    ]
    _bound(limiter, Reference(2.5, 1.0, 3.0), t=0.9)
    assert len(events) == 2  # once a second


@pytest.mark.parametrize("field", ["position", "velocity"])
def test_limits_leave_nan_in_the_reference_for_the_demand_to_show(field: str) -> None:
    limiter = Limiter(
        voltage=10.0, period=_PERIOD_S, notify=lambda _: None, position=1.9, velocity=9.5, error=1.0
    )
    assert math.isnan(getattr(_bound(limiter, Reference(0.0, 0.0, 0.0)._replace(**{field: math.nan})), field))


def test_limits_want_an_end_when_the_arm_stays_off_the_reference() -> None:
    limiter = Limiter(voltage=10.0, period=_PERIOD_S, notify=lambda _: None, error=0.5)
    for k in range(200):  # less than half a second, again and again
        for late in range(100):
            _bound(limiter, Reference(0.6, 0.0, 0.0), t=(k * 300 + late) * _PERIOD_S)
    assert _objection(limiter) is None
    for late in range(513):
        _bound(limiter, Reference(-0.6, 0.0, 0.0), t=1e3 + late * _PERIOD_S)
    stop = _objection(limiter)
    assert stop is not None
    assert (stop.reason, stop.urgency) == ("tracking", Urgency.RAMP)
