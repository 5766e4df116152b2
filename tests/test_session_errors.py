"""The disorderly end of a run: an error of a stage or of the device, a trip."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.errors import (
    BackendError,
    ConfigError,
    DcmpError,
    DeadlineError,
    LinkError,
    OpenError,
    TripError,
)
from dcmp_hil.ipc.run_end import NOT_ARMED, UNCONFIRMED
from dcmp_hil.session import Session
from dcmp_hil.values import EndData, Estimate, Event, Reference, Sample
from sim_backend.backend import SimBackend
from tests.helpers import STEADY, HeldRun, T, bench, named
from tests.live.here import Here
from tests.stages import ObserverAtRest, ZeroController, texts_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Self


class _Boom(BaseException):
    """An exception that is not derived from Exception."""


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit, _Boom, LinkError])
@pytest.mark.parametrize("where", ["observer", "controller", "read", "write"])
def test_amplifier_is_released_when_a_users_code_raises(where: str, error: type[BaseException]) -> None:
    # safety.md, S03: 0 V within a tick, then raise; BaseException too
    count = 0

    def boom() -> None:
        nonlocal count
        count += 1
        if count == 300:
            raise error("the user's own")

    class Observer(ObserverAtRest):
        def update(self, sample: Sample) -> Any:
            boom()
            return super().update(sample)

    class Controller(ZeroController):
        def update(self, reference: Reference, estimate: Estimate) -> Any:
            boom()
            return super().update(reference, estimate)

    def read(_: int, sample: Sample) -> Sample:
        boom()
        return sample

    held = HeldRun(
        *(
            [f"{where}.kind={named(Observer if where == 'observer' else Controller)}"]
            if where[-1] == "r"
            else []
        ),
        *STEADY,
        on_read=read if where == "read" else None,
        on_write=(lambda _: boom()) if where == "write" else None,
    )
    stage = where in {"observer", "controller"}
    named_one = stage and error is not LinkError  # as the failure of a class that the rig names
    named_one = named_one or error in {RuntimeError, SystemExit}
    ends: type[BaseException] = (TripError if stage else BackendError) if named_one else error
    with pytest.raises(ends, match="the user's own") as caught:
        held.run()
    assert not held.backend.live
    assert held.reads == 300
    result = held.session.result()
    if named_one:
        file = "test_session_errors.py" if stage else "helpers.py"
        assert f"{error.__name__}: the user's own (tests/{file}, line " in str(caught.value)
    if named_one and stage:  # the period is a whole one, at 0 V
        assert result.summary.periods == 300
        assert held.written[-1] == 0.0
    else:
        assert result.summary.periods == 299
    end = result.events[-1]
    confirmed = not issubclass(ends, BackendError)
    assert end.text == (
        "amplifier at 0 V" if confirmed else "0 V was not confirmed: the device goes there by itself"
    )
    assert end.t == pytest.approx(0.298, abs=2 * T)  # the time of the last period, not 0
    _says_what_ended_it(end, caught.value)


def _says_what_ended_it(end: Event, error: BaseException) -> None:
    if isinstance(error, KeyboardInterrupt):  # a person's wish
        assert end.data is None
        return
    assert isinstance(end.data, EndData)
    assert end.data.cause == getattr(error, "reason", type(error).__name__)
    assert "the user's own" in end.data.words


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_run_trips_when_the_controller_asks_for_no_number(bad: float) -> None:
    class Controller(ZeroController):
        calls = 0

        def update(self, reference: Reference, estimate: Estimate) -> Any:  # noqa: ARG002
            self.calls += 1
            return bad if self.calls == 400 else 0.5

    held = HeldRun(f"controller.kind={named(Controller)}", *STEADY[:1])
    with pytest.raises(TripError) as caught:
        held.run()
    assert caught.value.reason == "not_finite"
    assert held.written == [0.5] * 399 + [0.0]
    assert not held.backend.live
    assert len(caught.value.cycles) == 400
    assert caught.value.cycles[-1].voltage == 0.0


def test_amplifier_is_released_when_the_controller_returns_nothing() -> None:
    class Controller(ZeroController):
        def update(self, reference: Reference, estimate: Estimate) -> Any:  # noqa: ARG002
            return None

    held = HeldRun(f"controller.kind={named(Controller)}", *STEADY)
    with pytest.raises(TripError, match="returned None"):
        held.run()
    assert not held.backend.live
    assert held.written == [0.0]


@pytest.mark.parametrize("field", Estimate._fields)
def test_run_trips_when_the_observer_finds_no_number(field: str) -> None:
    class Observer(ObserverAtRest):
        def update(self, sample: Sample) -> Any:
            found = super().update(sample)
            return found._replace(**{field: math.nan}) if self.calls == 400 else found

    held = HeldRun(f"observer.kind={named(Observer)}", "supervisor.monitors=finite", *STEADY)
    with pytest.raises(TripError) as caught:
        held.run()
    assert caught.value.reason == "not_finite"
    assert held.written[-1] == 0.0
    assert len(held.written) == 400
    assert not held.backend.live


def test_trip_holds_the_last_second_of_cycles() -> None:
    def fault(n: int, sample: Sample) -> Sample:
        return sample._replace(fault=42) if n == 2500 else sample

    held = HeldRun(*STEADY, duration=9.0, on_read=fault)
    with pytest.raises(TripError) as caught:
        held.run()
    trip = caught.value
    assert trip.reason == "device_fault"
    assert "42" in trip.sentence
    assert [cycle.sample.t for cycle in trip.cycles] == pytest.approx([k * T for k in range(1501, 2501)])
    assert trip.cycles[-1].voltage == held.written[-1] == 0.0
    result = held.session.result()
    assert result.summary.periods == 2501
    errors = [event for event in result.events if event.level == "ERROR"]
    assert len(errors) == 1
    assert "device_fault" in errors[0].text
    assert errors[0].t == pytest.approx(2.5)
    assert texts_of(result)[-1] == "amplifier at 0 V"


@pytest.mark.parametrize("where", ["enter", "first sample"])
def test_trip_before_the_first_period_stays_what_it_is(where: str) -> None:
    # A device may refuse to arm, or trip before the first cycle is whole (safety.md, A3: exit code 4).
    class Refuses(SimBackend):
        def __enter__(self) -> Self:
            if where == "enter":
                raise TripError("probe", "The arm moves.", "Wait until it hangs still.")
            return super().__enter__()

        def read(self) -> Sample:
            raise TripError("probe", "The arm moves.", "Wait until it hangs still.")

    session = Session(bench(f"backend.kind={named(Refuses)}"), duration=1.0, fast=True)
    with pytest.raises(TripError, match="The arm moves") as caught:
        session.run()
    assert tuple(caught.value.cycles) == ()
    assert any("probe" in text for text in texts_of(session.result()))


@pytest.mark.parametrize(
    ("error", "end"),
    [
        (OpenError("Another host owns the device."), NOT_ARMED),
        (ConfigError("It is another device."), NOT_ARMED),
        (LinkError("The cable is out."), UNCONFIRMED),
        (RuntimeError("in the handshake"), UNCONFIRMED),
    ],
)
def test_run_that_never_armed_the_device_does_not_say_that_it_is_at_0_V(error: Exception, end: int) -> None:
    """Another host may hold the voltage: the panel showed 0.00 V."""

    class Refusing(SimBackend):
        def __enter__(self) -> Self:
            raise error

    control = Here()
    held = HeldRun(base=Refusing, control=control)
    with pytest.raises(DcmpError):
        held.run()
    assert control.end == end
    assert "at 0 V" not in control.last_words
    assert held.session.result().events[-1].text != "amplifier at 0 V"


def test_run_whose_sinks_cannot_be_made_does_not_say_that_the_device_is_at_0_V() -> None:
    class Unready(Here):
        def wait_until_up(self, stopped: Callable[[], bool]) -> None:  # noqa: ARG002
            raise DeadlineError("It cannot be promised.")

    control = Unready()
    held = HeldRun(control=control)
    with pytest.raises(DeadlineError):
        held.run()
    assert control.end == NOT_ARMED
    assert control.last_words.endswith("The device was not armed.")
