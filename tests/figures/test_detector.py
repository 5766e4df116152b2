"""What the host's monitors find, and how soon: "Detectors worth having" of the safety page."""

from __future__ import annotations

import math
from statistics import median

import pytest

from dcmp_hil import run
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.safety.monitors import DisturbanceWatch
from dcmp_hil.values import Estimate, Sample
from tests import helpers
from tests.figures.detection import ENGAGED_AT_S, detect
from tests.helpers import STEADY, FaultySim, T, bench, setting

pytestmark = pytest.mark.untraced


@pytest.mark.parametrize(
    ("backend", "reason"), [(helpers.StuckEncoder, "stuck"), (helpers.LostPower, "power")]
)
def test_blind_or_dead_motor_is_found_in_time(backend: type[FaultySim], reason: str) -> None:
    # E01, P02: 120 ms median, 600 ms at every seed; measured 74 and 132 ms (stuck), 89 and 209 ms (power)
    found = detect(backend)
    assert {each.reason for each in found} == {reason}
    times = [each.time for each in found]
    assert median(times) <= 0.120
    assert max(times) <= 0.600
    assert max(each.speed for each in found) <= 8.0


def test_reversal_is_found_in_time_while_the_arm_moves() -> None:
    # P01: 300 ms, 3 rad/s; measured 54 ms median, 98 ms at most
    found = detect(helpers.Reversed)
    assert {each.reason for each in found} == {"polarity"}
    assert max(each.tripped_at - each.fault_at for each in found) <= 0.300
    assert max(each.speed for each in found) <= 3.0


@pytest.mark.parametrize(
    ("start", "live_from"),
    [
        ("supervisor.start=engage", ENGAGED_AT_S),
        ("supervisor.start=immediate", 0.0),
    ],
)
def test_reversed_motor_is_found_in_time_from_rest(start: str, live_from: float) -> None:
    # safety.md: at most 230 ms (at rest) and 2.4 rad/s; bounds of P01
    found = detect(helpers.ReversedFromTheStart, start)
    assert {each.reason for each in found} <= {"polarity", "disturbance"}
    assert max(each.tripped_at - live_from for each in found) <= 0.300
    assert max(each.speed for each in found) <= 3.0


_HEALTHY = [
    (),
    STEADY,
    (*STEADY, "reference.soft_start_s=0.0"),
    ("sim.encoder_noise_counts=1.0",),
    ("sim.plant.ku_rad_s2_V=3.24",),
    ("sim.plant.ku_rad_s2_V=8.1",),
    (*STEADY, "sim.plant.ku_rad_s2_V=3.24", "reference.soft_start_s=0.0"),
    (*STEADY, "sim.plant.ku_rad_s2_V=8.1", "reference.soft_start_s=0.0"),
    (*STEADY, "reference.soft_start_s=0.0", "sim.dead_zone_V=0.05", "sim.voltage_step_mV=20.0"),
    ("backend.kind=tests.helpers:LosesSamples",),
    ("encoder.counts_per_rev=2000",),
    ("loop.rate_hz=500",),
    ("loop.rate_hz=4000",),
]


@pytest.mark.parametrize("overrides", _HEALTHY, ids=" ".join)
def test_healthy_rig_does_not_trip(overrides: tuple[str, ...]) -> None:
    for seed in range(4):
        result = run(
            bench(*overrides, f"sim.seed={seed}", f"sim.encoder_phase_counts={seed / 4}"),
            duration=7.0,  # the start and the first reversal, where w_hat is largest
            fast=True,
        )
        assert not [event for event in result.events if event.level == "ERROR"]


@pytest.mark.parametrize(
    ("overrides", "peak"),
    [
        (STEADY, 20.0),
        ((*STEADY, "sim.plant.ku_rad_s2_V=8.1", "reference.soft_start_s=0.0"), 45.0),
    ],
)
def test_healthy_rig_leaves_the_watch_room(overrides: tuple[str, ...], peak: float) -> None:
    # safety.md: healthy peak 20 rad/s2 (45 with ku x1.5 and no soft start) of the filtered |w_hat|; limit 50
    peaks = []
    for phase in (0.0, 0.25, 0.5, 0.75):
        columns = run(bench(*overrides, f"sim.encoder_phase_counts={phase}"), duration=7.0, fast=True).columns
        watch, keep, filtered = SuperTwisting(setting(), mu0=100.0), math.exp(-0.1), 0.0
        for row in zip(
            *(columns[name] for name in ("time_s", "position_rad", "voltage_applied_V")), strict=True
        ):
            t, position, applied = map(float, row)
            w = watch.update(Sample(t, position, applied)).disturbance
            filtered = keep * filtered + (1.0 - keep) * w
            peaks.append(abs(filtered))
    assert max(peaks) < 1.05 * peak


def test_watch_judges_by_an_observer_of_its_own() -> None:
    # The watch sees only sample and voltage, and nothing of the rig's own observer.
    watch = DisturbanceWatch(SuperTwisting(setting(), mu0=100.0), setting(), 50.0)

    still = Estimate(0.0, 0.0, 0.0)
    objections = (watch.check(Sample(k * T, 0.0, 10.0), still) for k in range(200))  # 10 V: w = -54 rad/s2
    stop = next(objection for objection in objections if objection is not None)
    assert "-55 rad" in stop.sentence
    assert stop.explain is not None
    assert stop.explain().reason == "stuck"


@pytest.mark.parametrize(
    ("backend", "reason"),
    [
        (helpers.ReversedFromTheStart, "polarity"),
        (helpers.DeadFromTheStart, "power"),
        (helpers.BlindFromTheStart, "power"),
    ],
)
def test_probe_finds_it_before_the_arm_has_moved_a_tenth_of_a_radian(
    backend: type[FaultySim], reason: str
) -> None:
    # P01: refused by the probe within 0.1 rad; dead and blind look the same to it
    found = detect(backend, "supervisor.probe=first")
    assert {each.reason for each in found} == {reason}
    assert max(each.tripped_at for each in found) <= 0.35
    assert max(each.distance for each in found) <= 0.1
