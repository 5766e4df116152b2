"""Late periods: what counts as one, and when they end a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.errors import DeadlineError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.safety.deadline_monitor import DeadlineMonitor
from dcmp_hil.trip_request import Urgency
from dcmp_hil.values import Timing
from sim_backend.backend import SimBackend
from tests.helpers import HeldRun, T, bench

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock

_ON_TIME = Timing(T, 0.0, 20e-6)
_LATE = Timing(1.6 * T, 0.6 * T, 20e-6)
_SLOW = Timing(T, 0.0, 1.1 * T)


def _warm(limit: int | None = None) -> DeadlineMonitor:
    """Return one that has seen its first 0.1 s."""
    overruns = DeadlineMonitor(T, limit)
    for _ in range(100):
        overruns.check(_ON_TIME)
    return overruns


def test_overruns_count_nothing_when_every_period_is_on_time() -> None:
    overruns = _warm(1)
    overruns.check(Timing(math.nan, 0.49 * T, T))
    assert overruns.count == 0


@pytest.mark.parametrize("timing", [_LATE, _SLOW])
def test_overruns_end_the_run_at_their_limit_of_twenty(timing: Timing) -> None:
    overruns = _warm(5)
    for _ in range(4):  # every fifth: the fourth of twenty
        overruns.check(timing)
        for _ in range(4):
            overruns.check(_ON_TIME)
    for _ in range(20):  # one leaves the window as the next comes
        overruns.check(timing)
        for _ in range(4):
            overruns.check(_ON_TIME)
    overruns.check(timing)
    assert overruns.count == 25
    concern = overruns.check(timing)
    assert concern is not None
    assert concern.urgency is Urgency.RAMP
    assert isinstance(concern.error(), DeadlineError)
    assert "5 of the last 20 periods of 1000 us were late" in str(concern.error())
    assert "timing.overrun" in str(concern.error())


def test_overruns_end_nothing_while_everything_is_cold() -> None:
    overruns = DeadlineMonitor(T, 1)
    for _ in range(100):
        overruns.check(_SLOW)
    overruns.check(_ON_TIME)
    assert overruns.count == 100
    assert overruns.check(_SLOW) is not None


def test_overruns_only_count_when_there_is_no_limit() -> None:
    overruns = DeadlineMonitor(T)
    for _ in range(1000):
        overruns.check(_SLOW)
    assert overruns.count == 1000


@pytest.mark.parametrize("ppm", [-10_000, -100, 100, 9_900])
def test_overruns_forgive_a_device_whose_clock_is_off(ppm: float) -> None:
    overruns = DeadlineMonitor(T, 1)
    for k in range(100_000):
        overruns.check(Timing(T, 1e-6 * ppm * k * T, 20e-6))
    assert overruns.count == 0


def test_overruns_see_lateness_when_the_first_sample_was_late_itself() -> None:
    overruns = _warm(1)
    overruns.check(Timing(T, -0.8 * T, 20e-6))
    assert overruns.check(Timing(T, 0.0, 20e-6)) is not None


class _Busy(SimBackend):
    """Virtual time in which every command from the hundredth to the two hundredth takes 2.3 periods."""

    def __init__(self, rig: Rig, clock: Clock) -> None:
        super().__init__(rig, clock)
        self.clock, self.writes = clock, 0

    def write(self, voltage: float) -> None:
        super().write(voltage)
        self.writes += 1
        if 100 < self.writes <= 200:
            self.clock.sleep_until_ns(self.clock.now_ns() + 2_300_000)


def test_run_ends_at_zero_volts_when_periods_are_late_and_the_rig_says_stop() -> None:
    held = HeldRun("timing.overrun=stop", "timing.overrun_limit=7", base=_Busy)
    with pytest.raises(DeadlineError):
        held.run()
    assert held.reads == 108  # one more: the supervisor's 0 V, as the arm is at rest yet
    assert not held.backend.live
    result = held.session.result()
    assert result.overruns == 8  # that one was late as well
    assert result.summary.periods == 108
    assert [event.level for event in result.events[-2:]] == ["ERROR", "INFO"]
    assert result.events[-1].text == "amplifier at 0 V"


def test_run_goes_through_every_period_when_the_rig_says_hold() -> None:
    result = HeldRun("timing.overrun=hold", duration=1.0, base=_Busy).run()
    np.testing.assert_allclose(np.diff(result.columns["time_s"]), T, rtol=1e-9)
    lateness_us = result.columns["lateness_us"]
    assert lateness_us[200] == pytest.approx(100 * 1300.0)  # 100 periods, 1.3 too long each
    assert lateness_us[400] == pytest.approx(0.0, abs=1e-6)  # caught up
    assert result.overruns == pytest.approx(228, abs=2)  # until 1.3 x 100 periods behind are made good


def test_run_drops_missed_periods_when_the_rig_says_skip() -> None:
    result = HeldRun("timing.overrun=skip", duration=1.0, base=_Busy).run()
    t, lateness_us = result.columns["time_s"], result.columns["lateness_us"]
    steps = np.round(np.diff(t) / T).astype(int)
    assert set(steps[100:200]) == {2, 3}
    assert set(steps[:100]) == set(steps[200:]) == {1}
    assert t[200] == pytest.approx(0.1 + 100 * 2.3 * T, abs=3 * T)  # device time kept up with the clock
    assert lateness_us.max() < 1000.0
    assert result.overruns == 100
    assert result.columns["position_true_rad"][-1] != 0.0


def test_skipping_lets_the_plant_run_on_with_the_held_voltage() -> None:
    rig = bench("timing.overrun=skip", "amplifier.slew_V_s=1000")
    clock = SimulatedClock()
    late, punctual = SimBackend(rig, clock), SimBackend(rig, SimulatedClock())
    with late, punctual:
        for backend in (late, punctual):
            backend.read()
            backend.write(4.0)
        clock.sleep_until_ns(7_900_000)
        skipped = late.read()
        sample = [punctual.read() for _ in range(7)][-1]
        assert skipped == sample
        assert late.truth() == punctual.truth()
        assert skipped.voltage == 4.0


def test_pace_starts_afresh_and_skips_nothing_after_a_stop_of_the_process() -> None:
    clock = SimulatedClock()
    with SimBackend(bench("timing.overrun=skip"), clock) as backend:
        backend.read()
        clock.sleep_until_ns(5_000_000_000)
        assert [round(backend.read().t / T) for _ in range(3)] == [1, 2, 3]
