"""One period is one straight line: the order of its stages, and which command acts when."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import loop, run
from dcmp_hil.control.friction_feedforward import FrictionFeedforward
from dcmp_hil.control.model import Model
from dcmp_hil.errors import TripError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.safety.outlier_filter import OutlierFilter
from dcmp_hil.trip_request import TripRequest
from dcmp_hil.values import Cycle, Estimate, Reference, Sample, Timing
from tests.helpers import STEADY, T, bench

if TYPE_CHECKING:
    from collections.abc import Callable


class _Stages:
    """Every stage of the line in one: each call is noted, with what it was given."""

    def __init__(self, clock: SimulatedClock, samples: list[Sample]) -> None:
        self.calls: list[tuple[str, tuple[Any, ...]]] = []
        self.clock = clock
        self.over: TripRequest | None = None
        self.trip_at = self.late_at = 10**9
        self.timings: list[Timing] = []
        self._samples = iter(samples)
        self._tick = -1

    def stage(self, names: dict[str, Callable[..., Any]], over: Callable[[], object] = lambda: None) -> Any:
        """Make one stage: its methods, and what they answer."""
        calls = self.calls

        class Stage:
            stopping = False

            @property
            def over(self) -> object:
                calls.append(("over", ()))
                return over()

            def __getattr__(self, name: str) -> Callable[..., Any]:
                def call(*arguments: Any) -> Any:
                    calls.append((name, arguments))
                    return names[name](*arguments)

                return call

        return Stage()

    def read(self) -> Sample:
        self._tick += 1
        self.clock.sleep_until_ns(self._tick * 1_000_000)
        return next(self._samples)

    def safe_voltage(self, *_: object) -> float:
        if self._tick >= self.trip_at:
            self.over = TripRequest("because", "Seen.", "Look.")
            return 0.0
        return 6.0

    def deadline(self, timing: Timing) -> TripRequest | None:
        self.timings.append(timing)
        return TripRequest("late", "Late.", "Look.", late=True) if self._tick == self.late_at else None

    def line(self) -> loop.LoopStages:
        """Make the line."""
        clock = self.clock

        def works(_: object, __: object) -> float:
            clock.sleep_until_ns(clock.now_ns() + 7_000)  # 7 us of work
            return 5.0

        return loop.LoopStages(
            backend=self.stage({"read": self.read, "write": lambda _: None}),
            outlier_filter=OutlierFilter(math.inf, 1e-3, 0.0),
            observer=self.stage({"update": lambda sample: Estimate(sample.position, 0.0, 0.0)}),
            predictor=self.stage({"ahead": lambda *_: Estimate(2.0, 0.0, 0.0), "sent": lambda _: None}),
            trajectory=self.stage(
                {"at": lambda t: Reference(t, 0.0, 0.0), "hold": lambda _: None, "begin": lambda _, __: None}
            ),
            controller=self.stage({"update": works}),
            supervisor=self.stage(
                {
                    "engages": lambda _: self._tick == 1,
                    "limit_reference": lambda _, reference: reference,
                    "safe_voltage": self.safe_voltage,
                    "stop": lambda _, __: None,
                },
                over=lambda: self.over,
            ),
            telemetry=self.stage({"record": lambda _: None}),
            deadline_monitor=self.stage({"check": self.deadline}),
            clock=clock,
            delay=0.001,
        )


class _Stop:
    requested = False


_SAMPLES = [Sample(0.5 + 0.001 * k, 0.25, 1.0 * k) for k in range(10)]


def _stages(trip_at: int = 10**9) -> tuple[_Stages, loop.LoopStages]:
    stages = _Stages(SimulatedClock(), _SAMPLES)
    stages.trip_at = trip_at
    return stages, stages.line()


def test_loop_passes_a_sample_through_its_stages_in_order() -> None:
    stages, line = _stages()
    assert loop.run(line, _SAMPLES[1].t, _Stop()) == _SAMPLES[1].t
    second = stages.calls[[name for name, _ in stages.calls].index("over") + 1 :]  # which has "begin"
    names = [name for name, _ in second]
    assert names == [
        "read", "update", "engages", "begin", "at", "limit_reference", "ahead", "update", "safe_voltage",
        "write", "sent", "record", "check", "over",
    ]  # fmt: skip
    given = dict(zip(range(len(second)), (arguments for _, arguments in second), strict=True))
    sample, estimate = _SAMPLES[1], Estimate(0.25, 0.0, 0.0)
    reference, ahead = Reference(sample.t + 0.001, 0.0, 0.0), Estimate(2.0, 0.0, 0.0)
    assert given[1] == (sample,)
    assert given[3] == (sample.t, 0.25)  # the trajectory starts at this sample, from the estimate
    assert given[4] == (sample.t + 0.001,)  # when the command takes effect
    assert given[5] == (sample, reference)
    assert given[6] == (sample, estimate, reference)
    assert given[7] == (reference, ahead)  # the controller sees the state ahead, the monitors the present
    assert given[8] == (sample, estimate, 5.0)
    assert given[9] == given[10] == (6.0,)
    cycle: Cycle = given[11][0]
    assert cycle[:5] == (sample, estimate, reference, 5.0, 6.0)
    assert stages.timings[1] == cycle.timing


def test_loop_hands_the_velocities_of_the_reference_to_the_friction_that_is_fed_forward() -> None:
    stages, line = _stages()
    asked = []

    def velocity(t: float) -> float:
        asked.append(t)
        return 1.0  # rad/s, beyond the ramp of the sign

    at = line.trajectory.at
    trajectory = SimpleNamespace(at=at, velocity=velocity, hold=lambda _: None, begin=lambda _, __: None)
    feedforward = FrictionFeedforward(Model(f1=1.3, ku=5.4))
    loop.run(replace(line, trajectory=trajectory, friction=feedforward), _SAMPLES[1].t, _Stop())
    first, second = _SAMPLES[:2]
    assert asked[2:] == [0.5 * (first.t + second.t), second.t + 0.001]  # in the middle, and when it acts
    told = [arguments[0] for name, arguments in stages.calls if name == "update"][2]
    assert told == second._replace(voltage=second.voltage - 1.3 * (1.0 / 5.4))
    cycle = [arguments[0] for name, arguments in stages.calls if name == "record"][1]
    assert cycle.sample == second  # as it was read
    assert cycle.estimate == Estimate(second.position, 0.0, -1.3)


def test_loop_times_its_periods() -> None:
    stages, line = _stages()
    loop.run(line, _SAMPLES[3].t, _Stop())
    cycles = [arguments[0] for name, arguments in stages.calls if name == "record"]
    assert np.isnan(cycles[0].timing.period)
    for cycle in cycles[1:]:
        assert cycle.timing == pytest.approx((1e-3, 0.0, 7e-6), abs=1e-12)


def test_loop_ends_with_the_period_in_which_the_stop_was_asked_for() -> None:
    stages, line = _stages()
    stop = _Stop()
    stop.requested = True
    assert loop.run(line, 1e9, stop) == _SAMPLES[0].t
    assert [name for name, _ in stages.calls].count("record") == 1


def test_loop_writes_zero_and_records_the_period_before_it_raises_a_trip() -> None:
    stages, line = _stages(trip_at=2)
    with pytest.raises(TripError, match="Seen"):
        loop.run(line, _SAMPLES[2].t, _Stop())  # tripping wins over the end
    assert [name for name, _ in stages.calls][-6:] == ["write", "sent", "record", "check", "over", "over"]
    assert stages.calls[-6] == ("write", (0.0,))
    assert stages.calls[-4][1][0].voltage == 0.0


def test_loop_hands_a_late_period_to_the_supervisor_behind_the_end_that_is_due() -> None:
    stages, line = _stages()
    stages.late_at = 1
    loop.run(line, _SAMPLES[3].t, _Stop())
    first = [name for name, _ in stages.calls].index("stop")
    assert [name for name, _ in stages.calls[first - 2 : first]] == ["check", "over"]
    assert stages.calls[first][1] == (TripRequest("late", "Late.", "Look.", late=True), _SAMPLES[1].t)
    assert [name for name, _ in stages.calls].count("stop") == 1


@pytest.mark.parametrize("delay", [0, 1])
def test_command_acts_after_its_delay_and_never_before(delay: int) -> None:
    # The command of sample k acts over [k + delay, k + delay + 1): sample k + delay + 1 reports it.
    columns = run(bench(*STEADY, f"loop.delay_samples={delay}"), duration=0.5, fast=True).columns
    sent, applied = columns["voltage_sent_V"], columns["voltage_applied_V"]
    later = delay + 1
    assert np.abs(np.diff(sent)).min() > 0.0, "every command must be told from its neighbours"
    assert (applied[later:] == sent[:-later]).all()
    assert (applied[:later] == 0.0).all()


@pytest.mark.parametrize("delay", [0, 1])
def test_tracking_error_is_taken_at_one_instant(delay: int) -> None:
    # x(t) - sin(t/2) at the sample's own t; with Cycle.reference it would be off by x_r' T = 0.5 mrad
    columns = run(
        bench(*STEADY, "reference.soft_start_s=0.0", f"loop.delay_samples={delay}"), duration=3.0, fast=True
    ).columns
    reference = np.sin(0.5 * columns["time_s"])
    np.testing.assert_allclose(columns["position_reference_rad"], reference, rtol=0, atol=1e-12)
    expected = 1e3 * (columns["position_true_rad"] - reference)
    np.testing.assert_allclose(columns["tracking_error_mrad"], expected, rtol=0, atol=1e-9)


def test_tracking_error_is_taken_at_one_instant_when_samples_are_lost() -> None:
    rig = bench(*STEADY, "reference.soft_start_s=0.0", "backend.kind=tests.helpers:LosesSamples")
    columns = run(rig, duration=3.0, fast=True).columns
    assert 2700 < len(columns["time_s"]) < 2950  # 5 % of 3000 lost
    assert np.diff(columns["time_s"]).max() > 1.5 * T
    reference = np.sin(0.5 * columns["time_s"])
    np.testing.assert_allclose(columns["position_reference_rad"], reference, rtol=0, atol=1e-12)
