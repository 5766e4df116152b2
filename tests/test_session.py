"""A run from rig to result: its length, its start, and every way in which it can end."""

from __future__ import annotations

import math
import os
import signal
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import load_rig, run
from dcmp_hil.errors import BackendError, ConfigError, LinkError, TripError
from dcmp_hil.session import Session
from dcmp_hil.values import Estimate, Reference, Sample
from sim_backend.backend import SimBackend
from tests.helpers import STEADY, HeldRun, T, bench, known, named

if TYPE_CHECKING:
    from typing import Self

    from dcmp_hil.result import Result
    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event


def _texts(result: Result) -> list[str]:
    return [event.text for event in result.events]


class _Zero:
    """A controller that asks for nothing."""

    def __init__(self, setting: object) -> None:
        pass

    def update(self, reference: Reference, estimate: Estimate) -> Any:  # noqa: ARG002
        return 0.0


class _AtRest:
    """An observer that always sees the same."""

    def __init__(self, setting: object) -> None:  # noqa: ARG002 - a rig's observer is made with it
        self.calls = 0

    def update(self, sample: Sample) -> Any:
        self.calls += 1
        return Estimate(sample.position, 0.0, 0.0)


# ---------------------------------------------------------------- length, window, repetition


@pytest.mark.parametrize(
    ("rate", "duration", "periods"),
    [
        (1000, 0.001, 1),
        (1000, 0.002, 2),
        (1000, 1.0, 1000),
        (1000, 3.013, 3013),
        (3000, 0.5, 1500),
        (10_000, 0.7, 7000),
        (300, 10.0, 3000),
    ],
)
def test_run_has_exactly_the_periods_of_its_duration(rate: int, duration: float, periods: int) -> None:
    result = run(bench(f"loop.rate_hz={rate}"), duration=duration, fast=True)
    assert result.summary.periods == periods
    t = result.columns["time_s"]
    np.testing.assert_allclose(t, np.arange(periods) / rate, rtol=1e-12, atol=0)
    assert {len(column) for column in result.columns.values()} == {periods}


def test_run_takes_the_rigs_duration_when_none_is_given() -> None:
    assert run(bench("run.duration_s=0.25"), fast=True).summary.periods == 250


def test_run_counts_its_figures_from_the_windows_start() -> None:
    whole = run(bench(*STEADY), duration=2.0, fast=True)
    late = run(bench(*STEADY), duration=2.0, fast=True, window_from=0.5)
    assert late.summary.periods == 1500
    assert late.summary.window_s == pytest.approx((0.5, 2.0))
    error = late.columns["tracking_error_mrad"]
    assert len(error) == 2000
    rms = float(np.sqrt(np.mean(error[500:] ** 2)))
    assert late.summary.tracking_rms_rad == pytest.approx(1e-3 * rms, rel=1e-9)
    assert whole.summary.periods == 2000


@pytest.mark.parametrize("overrides", [(), STEADY, ("sim.encoder_noise_counts=0.7", "sim.seed=3")])
def test_run_repeats_to_the_bit(overrides: tuple[str, ...]) -> None:
    one, other = (run(bench(*overrides), duration=5.0, fast=True) for _ in range(2))
    assert one.columns.keys() == other.columns.keys()
    for name, column in one.columns.items():
        assert column.tobytes() == other.columns[name].tobytes(), name
    assert one.events == other.events


def test_run_differs_by_seed_when_there_is_noise() -> None:
    noisy = [
        run(bench("sim.encoder_noise_counts=0.7", f"sim.seed={seed}"), duration=1.0, fast=True).columns
        for seed in (3, 4)
    ]
    assert (noisy[0]["position_rad"] != noisy[1]["position_rad"]).any()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((-1.0, 0.0), "duration"),
        ((math.nan, 0.0), "duration"),
        ((math.inf, 0.0), "duration"),
        ((0.0, 0.0), "duration"),  # until Ctrl-C, in virtual time
        ((1.0, 1.0), "from"),
        ((1.0, -0.1), "from"),
        ((1.0, math.nan), "from"),
    ],
)
def test_run_refuses_times_that_make_no_sense(arguments: tuple[float, float], says: str) -> None:
    duration, window_from = arguments
    with pytest.raises(ConfigError, match=says):
        run(bench(), fast=True, duration=duration, window_from=window_from)


def test_run_keeps_no_columns_when_told_so() -> None:
    session = Session(bench(*STEADY), duration=0.5, fast=True, keep_columns=False)
    session.run()
    result = session.result()
    assert result.columns == {}
    assert result.events == ()
    assert result.summary.periods == 500
    assert (
        result.summary.voltage_peak_V == run(bench(*STEADY), duration=0.5, fast=True).summary.voltage_peak_V
    )


def test_run_on_the_walls_clock_delivers_every_period() -> None:
    result = run(bench(), duration=0.03)
    assert result.summary.periods == len(result.columns["time_s"]) == 30
    assert result.dropped == 0
    assert _texts(result)[-1] == "amplifier at 0 V"


# ---------------------------------------------------------------- the start


def test_run_settles_then_engages_then_runs() -> None:
    # 0.25 s each (safety.md, "Start of a run"): 0 V, then a growing limit, then all of it
    rig = bench("supervisor.probe=off", "sim.position_rad=0.02", "sim.plant.eta_rad_s2=0.5")
    result = run(rig, duration=4.0, fast=True)
    phases = [(event.t, event.text) for event in result.events if event.kind == "phase"]
    assert [text for _, text in phases] == ["settling", "engaging", "running"]
    assert [t for t, _ in phases] == pytest.approx([0.0, 0.25, 0.5], abs=1e-9)
    t, sent = result.columns["time_s"], result.columns["voltage_sent_V"]
    settling, engaging = t < 0.2495, (t > 0.2495) & (t < 0.4995)
    assert (sent[settling] == 0.0).all()
    assert (np.abs(sent[engaging]) <= 10.0 * (t[engaging] - 0.25) / 0.25 + 1e-9).all()
    assert np.abs(sent[t > 0.5]).max() > 0.1


def test_run_probes_before_it_settles() -> None:
    # 0.1 s at 0 V, +1 V and -1 V for at most 0.1 s each (safety.md, "Start of a run")
    result = run(bench(), duration=2.0, fast=True)
    phases = [(event.t, event.text) for event in result.events if event.kind == "phase"]
    assert [text for _, text in phases] == ["probing", "settling", "engaging", "running"]
    assert [t for t, _ in phases] == pytest.approx([0.0, 0.3, 0.55, 0.8], abs=3e-3)
    t, sent = result.columns["time_s"], result.columns["voltage_sent_V"]
    assert set(sent[t < 0.0995]) == {0.0}
    assert set(sent[(t > 0.1005) & (t < 0.1995)]) == {1.0}
    assert set(sent[(t > 0.2025) & (t < 0.2995)]) == {-1.0}
    assert set(sent[(t > 0.3025) & (t < 0.5495)]) == {0.0}
    assert np.abs(result.columns["position_true_rad"][t < 0.6]).max() < 0.1


def test_run_starts_the_trajectorys_clock_with_engaging() -> None:
    result = run(bench("supervisor.probe=off", "sim.position_rad=0.02"), duration=6.0, fast=True)
    t, reference = result.columns["time_s"], result.columns["position_reference_rad"]
    late = t > 2.251  # after the soft start of 2 s
    np.testing.assert_allclose(reference[late], np.sin(0.5 * (t[late] - 0.25)), rtol=0, atol=1e-12)
    # in the period after the first of ENGAGING the reference is still at x0 = x1_hat
    k = int(np.flatnonzero(t > 0.2495)[0])
    assert reference[k + 1] == pytest.approx(result.columns["position_estimate_rad"][k], abs=1e-7)
    assert result.columns["position_estimate_rad"][k] == pytest.approx(0.02, abs=2e-3)


# ---------------------------------------------------------------- an orderly end


def test_run_lowers_the_arm_after_its_duration() -> None:
    duration = 0.25 + 3.0 * math.pi  # x_r = sin(3 pi / 2) = -1 rad
    held = HeldRun("run.end=lower", duration=duration)
    result = held.run()
    t, columns = result.columns["time_s"], result.columns
    assert t[-1] == pytest.approx(duration + 2.0, abs=4 * T)  # theory and rig.toml: a 2 s move
    end = int(np.flatnonzero(t >= duration - 0.5 * T)[0])
    assert columns["position_true_rad"][end] == pytest.approx(-1.0, abs=0.02)
    assert columns["position_true_rad"][-1] == pytest.approx(0.0, abs=3e-3)
    assert abs(columns["velocity_true_rad_s"][-1]) < 0.1
    assert np.abs(columns["tracking_error_mrad"][end:]).max() < 5.0
    assert "lowering the arm" in _texts(result)
    assert not [event for event in result.events if event.level == "WARN"]
    assert not held.backend.live


@pytest.mark.parametrize("rate", [0.5, 2.0])  # rad/s
def test_run_lowers_without_a_kick_when_the_arm_moves_fastest(rate: float) -> None:
    # at the zero of the sine the arm has its full velocity, amplitude x rate
    duration = 0.25 + 2.0 * math.pi / rate * math.ceil(1.0 + rate)
    rig = bench("supervisor.probe=off", "run.end=lower", f"reference.rate_rad_s={rate}")
    result = run(rig, duration=duration, fast=True)
    t, volts = result.columns["time_s"], result.columns["voltage_sent_V"]
    down = t > duration
    assert np.abs(result.columns["velocity_reference_rad_s"][~down][-1]) == pytest.approx(rate, rel=0.01)
    # holding 1 rad takes (14.03 + 1.3 + 1.04)/5.4 = 3 V; 12 V x rate / 0.5 was the kick of a sudden stop
    assert np.abs(volts[down]).max() < 5.0
    assert np.abs(np.diff(volts[t > 3.0])).max() < 2.0  # no jump from one period to the next


@pytest.mark.parametrize("way", ["stop", "trip"])
def test_run_does_not_lower_when_it_did_not_end_normally(way: str) -> None:
    def end_it(n: int, sample: Sample) -> Sample:
        if n == 700 and way == "stop":
            held.session.stop.requested = True
        return sample._replace(fault=9) if n == 700 and way == "trip" else sample

    held = HeldRun("run.end=lower", duration=1.0, on_read=end_it)
    if way == "trip":
        with pytest.raises(TripError):
            held.run()
    else:
        held.run()
    assert held.reads == 701
    assert "lowering the arm" not in _texts(held.session.result())
    assert not held.backend.live


def test_run_keeps_its_result_when_it_is_asked_to_stop() -> None:
    def ask(n: int, sample: Sample) -> Sample:
        held.session.stop.requested = n == 600
        return sample

    held = HeldRun(*STEADY, duration=30.0, on_read=ask)
    result = held.run()
    assert result.summary.periods == 601
    assert result.columns["time_s"][-1] == pytest.approx(0.6)
    assert not held.backend.live
    assert _texts(result)[-1] == "amplifier at 0 V"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_run_ends_in_the_same_period_when_a_signal_comes(number: signal.Signals) -> None:
    assert threading.current_thread() is threading.main_thread()
    before = signal.getsignal(number)

    def kill(n: int, sample: Sample) -> Sample:
        if n == 100:
            os.kill(os.getpid(), number)
        return sample

    held = HeldRun(*STEADY, duration=30.0, on_read=kill)
    result = held.run()
    assert held.reads == 101
    assert result.summary.periods == 101
    assert held.session.stop.signal is number
    assert not held.backend.live
    assert signal.getsignal(number) is before


def test_run_raises_at_once_when_ctrl_c_comes_twice() -> None:
    def kill(n: int, sample: Sample) -> Sample:
        for _ in range(2 if n == 100 else 0):
            os.kill(os.getpid(), signal.SIGINT)
        return sample

    held = HeldRun(*STEADY, duration=30.0, on_read=kill)
    with pytest.raises(KeyboardInterrupt):
        held.run()
    assert not held.backend.live
    assert held.session.result().summary.periods == 100


# ---------------------------------------------------------------- a disorderly end


class _Boom(BaseException):
    """Not even an Exception."""


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

    class Observer(_AtRest):
        def update(self, sample: Sample) -> Any:
            boom()
            return super().update(sample)

    class Controller(_Zero):
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
        assert (
            f"{error.__name__}: the user's own (tests/{'test_session' if stage else 'helpers'}.py, line "
            in str(caught.value)
        )
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


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_run_trips_when_the_controller_asks_for_no_number(bad: float) -> None:
    class Controller(_Zero):
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
    class Controller(_Zero):
        def update(self, reference: Reference, estimate: Estimate) -> Any:  # noqa: ARG002
            return None

    held = HeldRun(f"controller.kind={named(Controller)}", *STEADY)
    with pytest.raises(TripError, match="returned None"):
        held.run()
    assert not held.backend.live
    assert held.written == [0.0]


@pytest.mark.parametrize("field", Estimate._fields)
def test_run_trips_when_the_observer_finds_no_number(field: str) -> None:
    class Observer(_AtRest):
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
    assert _texts(result)[-1] == "amplifier at 0 V"


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
    assert any("probe" in text for text in _texts(session.result()))


# ---------------------------------------------------------------- sinks


class _Sink:
    def __init__(self, fails_at: int = 10**9) -> None:
        self.blocks = self.events = self.closed = 0
        self._fails_at = fails_at

    def block(self, block: Block) -> None:
        self.blocks += 1
        assert len(block) > 0
        if self.blocks == self._fails_at:
            raise OSError("disk full")

    def event(self, event: Event) -> None:  # noqa: ARG002
        self.events += 1

    def close(self) -> None:
        self.closed += 1


def test_run_tells_its_sinks_and_closes_them() -> None:
    sink = _Sink()
    run(bench(*STEADY), duration=10.0, fast=True, sinks=[sink])
    assert sink.blocks == 10  # a second each
    assert sink.events >= 4
    assert sink.closed == 1


@pytest.mark.parametrize(("duration", "fails_at"), [(10.0, 1), (10.0, 3), (0.1, 1)])
def test_run_goes_on_when_a_sink_raises(duration: float, fails_at: int) -> None:
    bad, good = _Sink(fails_at), _Sink()
    result = run(bench(*STEADY), duration=duration, fast=True, sinks=[bad, good])
    assert result.summary.periods == round(duration / T)
    assert bad.blocks == fails_at
    assert bad.closed == 0
    assert good.closed == 1
    warnings = [event.text for event in result.events if event.level == "WARN"]
    assert len(warnings) == 1
    assert "disk full" in warnings[0]


def test_reference_is_where_the_arm_is_when_it_settles() -> None:
    columns = run(load_rig("bench-1khz", ["sim.position_rad=0.1"]), duration=0.2, fast=True).columns
    assert columns["position_reference_rad"] == pytest.approx(columns["position_reference_rad"][0])
    assert columns["position_reference_rad"][0] == pytest.approx(0.1, abs=1e-3)


def test_probe_is_no_tracking_error() -> None:
    result = run(bench(), duration=1.5, fast=True)
    t, error = result.columns["time_s"], result.columns["tracking_error_mrad"]
    assert np.isnan(error[t < 0.545]).all()
    assert not np.isnan(error[t > 0.555]).any()
    assert known(result.summary.tracking_max_rad) < 0.02


def test_run_without_a_soft_start_has_a_start_like_any_other() -> None:
    result = run(bench("reference.soft_start_s=0.0", "reference.kind=hold"), duration=1.0, fast=True)
    assert result.summary.periods == 1000
