"""One protocol for "stop": every check returns it, raises nothing, and calls nothing back."""

from __future__ import annotations

import ast
import math
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import dcmp_hil
from dcmp_hil.assembly import make_limiter, make_outlier_filter, make_supervisor
from dcmp_hil.errors import DeadlineError, Explanation, TripError
from dcmp_hil.plugins.checked import CheckedController, CheckedObserver
from dcmp_hil.safety.deadline_monitor import DeadlineMonitor
from dcmp_hil.safety.monitors import FiniteMonitor, RangeMonitor
from dcmp_hil.safety.polarity_check import PolarityCheck
from dcmp_hil.safety.supervisor import Phase
from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.values import Estimate, Reference, Sample, Timing
from tests.helpers import T, bench

if TYPE_CHECKING:
    from dcmp_hil.trip_request import Check

PACKAGE = Path(dcmp_hil.__path__[0])
SAFETY = sorted([*PACKAGE.glob("safety/*.py"), PACKAGE / "plugins" / "checked.py"])
ODD = (0.0, 1.0, -1e308, math.inf, -math.inf, math.nan)


class _Broken:
    def update(self, *_: object) -> float:
        raise ZeroDivisionError


def _checks() -> list[Check]:
    rig = bench()
    made: list[Check] = [
        FiniteMonitor(),
        RangeMonitor(1.0, 1.0),
        make_outlier_filter(rig),
    ]
    return [*made, CheckedObserver(_Broken(), "a:B"), CheckedController(_Broken(), "a:B")]


@pytest.mark.parametrize("check", _checks(), ids=lambda check: type(check).__name__)
def test_a_check_raises_nothing_for_any_input(check: Check) -> None:
    for t, position, rest in product(ODD, repeat=3):
        stop = check.check(Sample(t, position, rest, 3), Estimate(position, rest, t))
        assert stop is None or isinstance(stop, TripRequest)


def test_probe_and_deadlines_raise_nothing_either() -> None:
    probe, overruns = PolarityCheck(5.4, 1.0, 0.0), DeadlineMonitor(T, 3)
    for t, position, voltage in product(ODD, repeat=3):
        for stop in (
            PolarityCheck(5.4, 1.0, 0.0).check(Sample(t, position, voltage)),
            probe.check(Sample(t, position, voltage)),
            overruns.check(Timing(t, position, voltage)),
        ):
            assert stop is None or isinstance(stop, TripRequest)


def test_the_limiter_raises_nothing_either() -> None:
    limiter = make_limiter(bench("amplifier.slew_V_s=100"), lambda _: None)
    for t, demand, last in product(ODD, repeat=3):
        assert isinstance(limiter.limit_voltage(t, demand, last), float)
    for t, position, x in product(ODD, ODD, (math.nan, math.inf, -math.inf)):
        limiter.limit_reference(Sample(t, position, 0.0), Reference(x, 0.0, 0.0))
    assert limiter.objection is None or isinstance(limiter.objection, TripRequest)


def test_no_room_of_safety_raises_a_trip_or_calls_back() -> None:
    assert len(SAFETY) > 10
    for path in SAFETY:
        name, source = path.name, path.read_text("utf-8")
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Raise) and node.exc is not None:
                assert not any(word in ast.unparse(node) for word in ("TripError", "DeadlineError")), name
        assert "TripError" not in source, name
        assert "DeadlineError" not in source, name


@pytest.mark.parametrize("urgency", Urgency)
@pytest.mark.parametrize("phase", [Phase.SETTLING, Phase.ENGAGING, Phase.RUNNING])
def test_each_urgency_ends_each_phase_in_its_bound_and_with_0_V(phase: Phase, urgency: Urgency) -> None:
    supervisor = make_supervisor(bench("supervisor.probe=off"), lambda _: None)
    asked, sent = TripRequest("because", "Seen.", "Look.", urgency), []
    asked_at, over, k = None, None, 0
    while over is None:
        sample = Sample(k * T, 0.0, 0.0)
        supervisor.engages(sample)
        sent.append(supervisor.safe_voltage(sample, Estimate(0.0, 0.0, 0.0), 1.0))
        late = None
        if asked_at is None and k > 0 and supervisor.phase is phase:
            asked_at, late = k, asked
        over = supervisor.over
        if late is not None:
            supervisor.stop(late, k * T)
        k += 1
        assert k < 2000
    assert asked_at is not None
    led = urgency is Urgency.RAMP and phase is not Phase.SETTLING
    assert over == asked._replace(orderly=led)
    assert k - 1 - asked_at <= (51 if led else 1)
    assert sent[-1] == 0.0
    assert (max(sent[asked_at + 1 :]) > 0.0) == (led and phase is Phase.RUNNING)
    assert supervisor.safe_voltage(Sample(k * T, 0.0, 0.0), Estimate(0.0, 0.0, 0.0), 1.0) == 0.0
    assert supervisor.phase is Phase.TRIPPED


def test_the_first_cause_wins_and_is_told_as_an_error() -> None:
    supervisor = make_supervisor(bench(), lambda _: None)
    supervisor.stop(TripRequest("first", "One.", "Look."), 0.0)
    supervisor.stop(TripRequest("second", "Two.", "Look.", Urgency.RAMP), 0.0)
    supervisor.stop(TripRequest("third", "Three.", "Look.", late=True), 0.0)
    over = supervisor.over
    assert over is not None
    assert over.reason == "first"


def test_a_stop_becomes_the_error_of_its_exit_code() -> None:
    late = TripRequest("deadline", "Late.", "Close programs.", Urgency.RAMP, late=True).error()
    assert isinstance(late, DeadlineError)
    assert (str(late), late.exit_code) == ("Late. Close programs.", 5)
    cause = ValueError("mine")
    trip = TripRequest("plugin", "Seen.", "Look.", cause=cause, orderly=True).error()
    assert isinstance(trip, TripError)
    assert (trip.reason, trip.sentence, trip.remedy, trip.orderly) == ("plugin", "Seen.", "Look.", True)
    assert trip.__cause__ is cause
    assert trip.explained() is trip


def test_the_likely_cause_is_found_after_the_end_with_notes_kept() -> None:
    stop = TripRequest(
        "disturbance", "Seen.", "", explain=lambda: Explanation("stuck", "It stands.", "Look there.")
    )
    trip = stop.error()
    assert isinstance(trip, TripError)
    trip.add_note("0 V was not confirmed")
    found = trip.explained()
    assert (found.reason, str(found)) == ("stuck", "It stands. Look there.")
    assert found.__notes__ == ["0 V was not confirmed"]
