"""Stages of the user's own that fail in a run: 0 V in that period; class, file and line in one sentence."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import BackendError, Estimate, Sample, TripError, Truth, run
from dcmp_hil.plugins.checked import CheckedController, CheckedObserver, failure_of
from dcmp_hil.plugins.checked_backend import CheckedBackend
from dcmp_hil.plugins.numbers import plain_number
from dcmp_hil.values import Reference
from sim_backend.backend import SimBackend
from tests.helpers import STEADY, HeldRun, bench, named

if TYPE_CHECKING:
    from collections.abc import Callable

AT = 350  # the period that goes wrong, in full authority


class _Wild:
    def __repr__(self) -> str:
        raise RuntimeError("not even that")


def _returns(value: Any) -> Callable[[], Any]:
    return lambda: value


def _raises(error: BaseException) -> Callable[[], Any]:
    def fail() -> Any:
        raise error

    return fail


NO_NUMBER: dict[str, Any] = {
    "none": None,
    "text": "3",
    "array": np.array([1.0]),
    "array of two": np.array([1.0, 2.0]),
    "array without an axis": np.array(1.0),
    "complex": 1j,
    "too large": 10**400,
    "too large to be written": 10**5000,
    "true": True,
    "list": [1.0],
    "wild": _Wild(),
}
NOT_FINITE: dict[str, Any] = {"nan": math.nan, "inf": -math.inf, "numpy's nan": np.float32(math.nan)}


def _trip(stage: str, answer: Callable[[], Any]) -> tuple[TripError, HeldRun]:
    """Run with a stage of one's own that answers otherwise in one period; return how the run ended."""

    class Own:
        calls = 0

        def __init__(self, context: object) -> None:
            pass

        def update(self, *arguments: Any) -> Any:
            self.calls += 1
            if self.calls > AT:
                return answer()
            return Estimate(arguments[0].position, 0.0, 0.0) if stage == "observer" else 0.5

    held = HeldRun(f"{stage}.kind={named(Own)}", *STEADY, "supervisor.monitors=finite")
    with pytest.raises(TripError) as caught:
        held.run()
    return caught.value, held


def _check(trip: TripError, held: HeldRun, stage: str) -> None:
    assert held.written[-1] == 0.0
    assert len(held.written) == AT + 1
    assert stage == "observer" or held.written[:-1] == [0.5] * AT
    assert not held.backend.live
    assert trip.cycles[-1].voltage == 0.0
    assert "tests.helpers:made_" in str(trip)
    assert "(tests/plugins/test_checked.py, line " in str(trip)
    assert "\n" not in str(trip)
    assert len(str(trip)) < 400
    result = held.session.result()
    assert [event.text for event in result.events if event.kind == "phase"][-1] == "tripped"
    assert len([event for event in result.events if event.level == "ERROR"]) == 1


@pytest.mark.parametrize("name", NO_NUMBER)
def test_controller_that_returns_no_number_is_named(name: str) -> None:
    trip, held = _trip("controller", _returns(NO_NUMBER[name]))
    assert trip.reason == "plugin"
    assert ".update returned " in str(trip)
    assert "expected a voltage" in str(trip)
    _check(trip, held, "controller")


@pytest.mark.parametrize(
    "estimate",
    [
        (0.0, 0.0, 0.0),
        0.0,
        np.zeros(3),
        {"position": 0.0},
        *(Estimate(0.0, value, 0.0) for value in NO_NUMBER.values()),
        *NO_NUMBER.values(),
    ],
    ids=lambda value: type(value).__name__,
)
def test_observer_that_returns_no_estimate_is_named(estimate: Any) -> None:
    trip, held = _trip("observer", _returns(estimate))
    assert trip.reason == "plugin"
    assert "expected Estimate(position, velocity, disturbance)" in str(trip)
    _check(trip, held, "observer")


@pytest.mark.parametrize("name", NOT_FINITE)
@pytest.mark.parametrize("stage", ["observer", "controller"])
def test_stage_that_finds_no_finite_number_is_named(stage: str, name: str) -> None:
    value = NOT_FINITE[name]
    trip, held = _trip(stage, _returns(Estimate(0.0, value, 0.0) if stage == "observer" else value))
    assert trip.reason == "not_finite"
    _check(trip, held, stage)


@pytest.mark.parametrize(
    "error",
    [ZeroDivisionError("by zero"), SystemExit(3), ValueError("a\nb"), RecursionError(), StopIteration(1)],
)
@pytest.mark.parametrize("stage", ["observer", "controller"])
def test_stage_that_raises_is_named(stage: str, error: BaseException) -> None:
    trip, held = _trip(stage, _raises(error))
    assert trip.reason == "plugin"
    assert f" raised {type(error).__name__}" in str(trip)
    assert trip.__cause__ is error  # Python shows the traceback
    _check(trip, held, stage)


def test_first_of_two_stages_that_fail_is_the_cause() -> None:
    class Observer:
        calls = 0

        def __init__(self, context: object) -> None:
            pass

        def update(self, sample: Sample) -> Any:
            self.calls += 1
            return None if self.calls > AT else Estimate(sample.position, 0.0, 0.0)

    class Controller:
        def __init__(self, context: object) -> None:
            pass

        def update(self, reference: Reference, estimate: Estimate) -> float:  # noqa: ARG002
            return 0.0 * int(estimate.velocity)  # raises on NaN

    rig = bench(f"observer.kind={named(Observer)}", f"controller.kind={named(Controller)}", *STEADY)
    with pytest.raises(TripError, match=r"returned None .*expected Estimate"):
        run(rig, duration=2.0, fast=True)


def test_observer_of_ones_own_under_friction_feedforward_is_named_too() -> None:
    class Observer:
        def __init__(self, context: object) -> None:
            pass

        def update(self, sample: Sample) -> Any:
            return (sample.position, 0.0, 0.0)

    rig = bench(f"observer.kind={named(Observer)}", "controller.friction_feedforward=true", *STEADY)
    with pytest.raises(TripError, match=r"returned \(.*expected Estimate"):
        run(rig, duration=2.0, fast=True)


@pytest.mark.parametrize("number", [np.float64(0.5), np.float32(0.5), np.int64(1), 1, Fraction(1, 2)])
def test_numbers_of_other_kinds_become_plain_ones(number: Any) -> None:
    class Own:
        def update(self, *_: object) -> Any:
            return self.answer

        answer: Any = number

    own = Own()
    voltage = CheckedController(own, "mine:Own").update(Reference(0.0, 0.0, 0.0), Estimate(0.0, 0.0, 0.0))
    assert type(voltage) is float
    assert voltage == float(number)
    own.answer = Estimate(number, number, number)
    checked = CheckedObserver(own, "mine:Own")
    assert checked.update(Sample(0.0, 0.0, 0.0)) == (voltage, voltage, voltage)
    assert {type(value) for value in checked.update(Sample(0.0, 0.0, 0.0))} == {float}
    assert failure_of(checked) is None


@pytest.mark.parametrize("value", NO_NUMBER.values(), ids=NO_NUMBER)
def test_what_is_no_number_is_none(value: Any) -> None:
    assert plain_number(value) is None


@pytest.mark.parametrize("method", ["__enter__", "read", "write", "truth", "__exit__"])
def test_backend_of_ones_own_that_raises_is_named(method: str) -> None:
    def fail(self: Any, *arguments: Any) -> Any:
        calls[0] += 1
        if calls[0] > (100 if method in {"read", "write", "truth"} else 0):
            raise ZeroDivisionError("by zero")
        return getattr(SimBackend, method)(self, *arguments)

    calls = [0]
    own = type("Own", (SimBackend,), {method: fail})
    with pytest.raises(BackendError, match=r"by zero \(tests/plugins/test_checked\.py, line \d+\)") as caught:
        run(bench(f"backend.kind={named(own)}"), duration=1.0, fast=True)
    assert "tests.helpers:made_" in str(caught.value)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


@pytest.mark.parametrize("numbers", [None, (0.0, None, 0.0), ("0.0", 0.0, 0.0), (0.0, 0.0, 0.0, "0")])
def test_backend_of_ones_own_that_returns_no_sample_is_named(numbers: Any) -> None:
    answer = Sample(*numbers) if numbers else (0.0, 0.0, 0.0)
    own = type("Own", (SimBackend,), {"read": lambda _: answer})
    with pytest.raises(
        BackendError, match=r"read returned .* \(tests/plugins/test_checked\.py, line \d+\); expected"
    ):
        run(bench(f"backend.kind={named(own)}"), duration=1.0, fast=True)


def test_backend_of_ones_own_may_return_numpys_numbers() -> None:
    class Own:
        def read(self) -> Sample:
            return Sample(np.float64(1.0), np.float32(2.0), 3, np.int64(0))  # type: ignore[arg-type]

        def truth(self) -> Truth:
            return Truth(np.float32(1.0), 2, math.nan)  # type: ignore[arg-type]

        def write(self, voltage: float) -> None: ...

        counters = 7

    checked = CheckedBackend(Own(), "mine:Own")
    assert checked.read() == (1.0, 2.0, 3.0, 0)
    assert {type(value) for value in checked.read()[:3]} == {float}
    assert checked.truth()[:2] == (1.0, 2.0)
    assert checked.counters == 7
    with pytest.raises(AttributeError):
        checked.described  # noqa: B018


def test_failure_to_leave_a_backend_of_ones_own_is_a_note_to_what_was_wrong_before() -> None:
    def leave(*_: object) -> None:
        raise OSError("gone")

    def read(_: object) -> Sample:
        raise KeyError("no such channel")

    own = type("Own", (SimBackend,), {"read": read, "__exit__": leave})
    with pytest.raises(BackendError, match="no such channel") as caught:
        run(bench(f"backend.kind={named(own)}"), duration=1.0, fast=True)
    (note,) = caught.value.__notes__
    assert "OSError: gone" in note
