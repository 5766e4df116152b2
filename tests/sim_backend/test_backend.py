"""The simulated rig as a backend: its clock, its pace, its end."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.errors import LinkError
from dcmp_hil.platform.clock import SimulatedClock
from sim_backend.backend import SimBackend
from tests.helpers import bench

_MS = 1_000_000  # ns


class _FakeClock:
    """Remembers the deadlines; time goes on only by sleeping and by `now_ns` being moved."""

    def __init__(self) -> None:
        self.now = 123 * _MS
        self.deadlines: list[int] = []
        self.slept: list[bool] = []

    def now_ns(self) -> int:
        return self.now

    def sleep_until_ns(self, deadline_ns: int) -> None:
        self.deadlines.append(deadline_ns)
        self.slept.append(deadline_ns > self.now)
        self.now = max(self.now, deadline_ns)


def test_sim_backend_refuses_to_be_read_when_it_is_not_open() -> None:
    backend = SimBackend(bench(), SimulatedClock())
    with pytest.raises(LinkError, match="closed"):
        backend.read()
    with backend:
        backend.read()
    with pytest.raises(LinkError, match="closed"):
        backend.read()


def test_sim_backend_is_live_only_while_it_is_entered() -> None:
    backend = SimBackend(bench(), SimulatedClock())
    lives = [backend.live]
    with backend:
        lives.append(backend.live)
    lives.append(backend.live)
    assert lives == [False, True, False]


def test_sim_backend_starts_at_time_zero_where_the_arm_is() -> None:
    backend = SimBackend(bench("sim.position_rad=-1.57", "encoder.counts_per_rev=ideal"), SimulatedClock())
    with backend:
        assert backend.read() == (0.0, -1.57, 0.0, 0)
        assert backend.truth()[:2] == (-1.57, 0.0)
        assert math.isnan(backend.truth().disturbance)
        assert backend.read().t == pytest.approx(1e-3, rel=1e-12)


@pytest.mark.parametrize(("delay", "applied"), [(0, [0.0, 1.0, 2.0, 3.0]), (1, [0.0, 0.0, 1.0, 2.0])])
def test_sim_backend_reports_the_voltage_of_the_period_that_ended(delay: int, applied: list[float]) -> None:
    # A command written after sample k acts over [k + delay, k + delay + 1).
    backend, got = SimBackend(bench(f"loop.delay_samples={delay}"), SimulatedClock()), []
    with backend:
        for command in (1.0, 2.0, 3.0, 4.0):
            got.append(backend.read().voltage)
            backend.write(command)
    assert got == applied


def test_sim_backend_takes_its_shortcomings_from_the_rig() -> None:
    rig = bench(
        "loop.delay_samples=0", "amplifier.slew_V_s=450.0", "sim.dead_zone_V=0.4", "sim.voltage_step_mV=100.0"
    )
    backend, got = SimBackend(rig, SimulatedClock()), []
    with backend:
        backend.read()
        for command in (0.22, 2.0, 2.0, 2.0, 2.0):
            backend.write(command)
            got.append(backend.read().voltage)
    # 0.45 V a period, in steps of 0.1 V, nothing below 0.4 V: of 0.22, 0.67, 1.12, 1.57, 2
    assert got == pytest.approx([0.0, 0.7, 1.1, 1.6, 2.0])


def test_sim_backend_paces_by_absolute_deadlines() -> None:
    clock = _FakeClock()
    backend = SimBackend(bench(), clock)
    with backend:
        for k in range(50):
            backend.read()
            clock.now += 300_000 if k % 2 else 0  # the loop's own work must not add up
    assert clock.deadlines == [123 * _MS + k * _MS for k in range(50)]


def test_sim_backend_paces_without_rounding_drift_when_the_period_is_no_whole_ns() -> None:
    clock = _FakeClock()
    backend = SimBackend(bench("loop.rate_hz=3000", "sim.step_us=auto"), clock)
    with backend:
        for _ in range(3001):
            backend.read()
    assert clock.deadlines[-1] - clock.deadlines[0] == 1_000_000_000  # 3000 periods are one second


def test_sim_backend_catches_up_when_it_was_a_little_late() -> None:
    clock = _FakeClock()
    backend = SimBackend(bench(), clock)
    with backend:
        for _ in range(10):
            backend.read()
        clock.now += 5 * _MS
        for _ in range(20):
            backend.read()
    assert clock.deadlines == [123 * _MS + k * _MS for k in range(30)]
    assert clock.slept.count(False) <= 1 + 5  # the very first deadline is now


def test_sim_backend_does_not_burst_when_it_was_stopped_for_seconds() -> None:
    clock = _FakeClock()
    backend = SimBackend(bench(), clock)
    with backend:
        for _ in range(10):
            backend.read()
        clock.now += 5000 * _MS  # safety.md, T05
        del clock.slept[:]
        for _ in range(100):
            backend.read()
    assert clock.slept.count(False) <= 1, "5000 old periods must not be run one after the other"
    assert clock.now == pytest.approx(123 * _MS + 5009 * _MS + 99 * _MS, abs=_MS)


def test_simulated_clock_never_runs_backwards() -> None:
    clock = SimulatedClock()
    clock.sleep_until_ns(5)
    clock.sleep_until_ns(3)
    assert clock.now_ns() == 5
