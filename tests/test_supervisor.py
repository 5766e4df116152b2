"""The supervisor: phases in order, authority, clamp, and the first cause that wins."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.errors import TripError
from dcmp_hil.supervisor import Phase, Supervisor
from dcmp_hil.values import Estimate, Event, Sample

_AT_REST = Estimate(0.0, 0.0, 0.0)
_PERIOD = 1.0 / 1024.0  # s, exact in binary: phases change at the very period


class _Objects:
    def __init__(self, at: float, reason: str = "because") -> None:
        self.at, self._reason = at, reason

    def check(self, sample: Sample, estimate: Estimate) -> None:  # noqa: ARG002
        if sample.t >= self.at:
            raise TripError(self._reason, "Seen.", "Look.")


def _supervisor(
    *monitors: _Objects, limit: float = 10.0, settle: float = 0.25, engage: float = 0.25
) -> tuple[Supervisor, list[Event]]:
    events: list[Event] = []
    made = Supervisor(monitors, voltage_limit=limit, settle=settle, engage=engage, notify=events.append)
    return made, events


def _period(supervisor: Supervisor, t: float, demand: float) -> tuple[bool, float]:
    sample = Sample(t, 0.0, 0.0)
    engages = supervisor.engages(sample)
    return engages, supervisor.admit(sample, _AT_REST, demand)


def test_supervisor_goes_through_its_phases_in_order() -> None:
    supervisor, events = _supervisor()
    begun = []
    for k in range(1024):
        engages, voltage = _period(supervisor, 5.0 + k * _PERIOD, 1e6)
        if engages:
            begun.append(k)
        if k < 256:
            assert voltage == 0.0
        elif k < 512:  # a ramp from 0 to 10 V
            assert voltage == pytest.approx(10.0 * (k - 256) / 256, abs=1e-9)
        else:
            assert voltage == 10.0
    assert begun == [256]
    phases = [(event.t, event.text) for event in events if event.level == "PHASE"]
    assert phases == [(5.0, "settling"), (5.25, "engaging"), (5.5, "running")]
    assert supervisor.phase is Phase.RUNNING


def test_supervisor_has_full_authority_at_once_when_immediate() -> None:
    supervisor, _ = _supervisor(settle=0.0, engage=0.0)
    assert _period(supervisor, 0.0, 7.0) == (True, 7.0)
    assert supervisor.phase is Phase.RUNNING
    assert _period(supervisor, _PERIOD, 7.0) == (False, 7.0)


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
    assert supervisor.clamped == (abs(demand) > limit)


@pytest.mark.parametrize("demand", [10.0, -10.0])
def test_supervisor_does_not_call_the_limit_itself_clamped(demand: float) -> None:
    supervisor, events = _supervisor(settle=0.0, engage=0.0)
    assert _period(supervisor, 0.0, demand)[1] == demand
    assert supervisor.clamped == 0
    assert not [event for event in events if event.level == "WARN"]


def test_supervisor_says_it_once_a_second_when_it_clamps() -> None:
    supervisor, events = _supervisor(settle=0.0, engage=0.0)
    for k in range(3 * 1024):
        _period(supervisor, k * _PERIOD, 11.0)
    warnings = [event.t for event in events if event.level == "WARN"]
    assert warnings == [0.0, 1.0, 2.0]
    assert supervisor.clamped == 3 * 1024


def test_supervisor_is_silent_when_the_growing_limit_bites() -> None:
    supervisor, events = _supervisor()
    for k in range(512):
        _period(supervisor, k * _PERIOD, 1.0)
    assert supervisor.clamped == 0
    assert {event.level for event in events} == {"PHASE"}


def test_supervisor_lets_everything_through_when_there_is_no_limit() -> None:
    supervisor, _ = _supervisor(limit=math.inf)
    voltages = [_period(supervisor, k * _PERIOD, 1175.0)[1] for k in range(1024)]
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
    assert supervisor.trip is not None


def test_supervisor_keeps_the_first_cause() -> None:
    supervisor, _ = _supervisor(_Objects(1.0, "second"), _Objects(0.5, "first"), settle=0.0, engage=0.0)
    for t in (0.4, 0.6, 1.2):
        _period(supervisor, t, math.nan if t > 1.0 else 1.0)
    assert supervisor.trip is not None
    assert supervisor.trip.reason == "first"


@pytest.mark.parametrize("demand", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("settle", [0.0, 0.25])
def test_supervisor_trips_when_the_demand_is_not_finite(demand: float, settle: float) -> None:
    supervisor, _ = _supervisor(settle=settle)
    assert _period(supervisor, 0.0, demand)[1] == 0.0
    assert supervisor.trip is not None
    assert supervisor.trip.reason == "not_finite"


def test_supervisor_trips_while_it_settles_too() -> None:
    supervisor, _ = _supervisor(_Objects(0.1))
    for t in (0.0, 0.1):
        _period(supervisor, t, 0.0)
    assert supervisor.trip is not None
