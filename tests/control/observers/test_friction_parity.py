"""R6 against its independent implementation: single steps from random states, whole rides, the predictor."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.friction_kalman.predictor import FrictionPredictor
from dcmp_hil.values import Estimate, Reference, Sample
from tests.control.observers.friction_pair import Pair, random_case, random_pair
from tests.control.observers.friction_reference_motion import ahead, compensated, predict
from tests.helpers import STEADY, bench

_STATES = 10_000
_OFTEN = 100
_RIDE_S = 10.001  # the first sample is no step
_BRANCHES = {
    *("stays at rest", "leaves from rest", "slips", "stops and sticks", "stops and leaves", "reversal zone"),
    *("no innovation", "excess", "edge up", "edge down", "several counts", "breaks away"),
    *("rho learns", "rho at 1", "rho at 30", "slow mean", "cap of m", "cap of ms"),
    *("step hypothesis", "floor of h", "cap of s2", "f at 0", "f at 4 f1"),
}


@pytest.mark.untraced
def test_one_step_equals_the_reference_from_random_states() -> None:
    draw = np.random.default_rng(16)
    reached: Counter[str] = Counter()
    for _ in range(_STATES):
        pair = random_pair(draw)
        case = random_case(draw, pair)
        pair.put(case.x, case.p, case.trust)
        got, wanted = pair.step(case.dt, pair.y + case.rise * pair.reference.arm.q, case.voltage)
        assert not pair.differences(1e-9), (case, pair.reference.reached)
        assert np.all(np.abs(np.subtract(got, wanted)) <= 1e-9 * (1.0 + np.abs(wanted))), case
        reached.update(pair.reference.reached)
    assert set(reached) == _BRANCHES
    assert min(reached.values()) >= _OFTEN, reached.most_common()


@pytest.mark.untraced
@pytest.mark.parametrize("counts", [1024, 4096])
def test_ten_thousand_steps_of_a_ride_equal_the_reference(counts: int) -> None:
    rig = bench(*STEADY, 'observer.kind="friction_kalman"', f"encoder.counts_per_rev={counts}")
    columns = run(rig, duration=_RIDE_S, fast=True, faults=["plant.push:at=4s,rad_s2=15"]).columns
    names = ("position_estimate_rad", "velocity_estimate_rad_s", "disturbance_estimate_rad_s2")
    seen = np.array([columns[name] for name in names]).T
    pair = Pair(counts=counts, period=rig.period, model=rig.model.values())
    pair.t = float(columns["time_s"][0])
    pair.start(float(columns["position_rad"][0]))
    rows = zip(*(columns[name][1:] for name in ("time_s", "position_rad", "voltage_applied_V")), strict=True)
    ways = set[str]()
    for k, (t, y, voltage) in enumerate(rows, 1):
        got, wanted = pair.step(float(t) - pair.t, float(y), float(voltage))
        pair.t = float(t)
        assert not pair.differences(1e-7), (k, pair.reference.reached)
        assert np.all(np.abs(np.subtract(got, wanted)) <= 1e-7 * (1.0 + np.abs(wanted))), k
        assert tuple(got) == tuple(seen[k]), k  # the loop's observer did the same, to the bit
        ways.update(pair.reference.reached)
    assert k == _STATES
    assert {"slips", "stays at rest", "stops and sticks", "leaves from rest", "slow mean"} <= ways


@pytest.mark.parametrize("measured", [False, True])
@pytest.mark.parametrize("delay", [0, 1])
def test_predictor_equals_the_reference_and_leaves_the_observer_alone(delay: int, measured: bool) -> None:
    draw = np.random.default_rng(3)
    ways = set[str]()
    for _ in range(400):
        pair = random_pair(draw)
        case = random_case(draw, pair)
        pair.put(case.x, case.p, case.trust)
        arm, observer = pair.reference.arm, pair.observer
        context = ObserverContext(pair.model, arm.period, 2.0 * np.pi / arm.q)
        predictor = FrictionPredictor(observer, context, delay, measured=measured)
        before = observer.state, observer.covariance, observer.trust, observer.sticks
        predictor.sent(-3.0)
        predictor.sent(case.voltage)
        velocity = float(draw.choice([0.0, draw.normal(0.0, 5e-4), draw.normal(0.0, 1.0)]))
        # What the observer reports is no part of it: w_hat would hunt at rest.
        sample, reported = Sample(pair.t, pair.y, 0.0), Estimate(7.0, 7.0, 7.0)
        got = predictor.ahead(sample, reported, Reference(0.0, velocity, 0.0))
        under_way = [(arm.period, pair.model.ku * case.voltage)] * delay
        x1p, x2p, d = ahead(case.x, under_way, arm)
        wanted = (pair.y if measured else x1p, x2p, compensated(x1p, d, float(case.x[3]), velocity, arm))
        assert np.all(np.abs(np.subtract(got, wanted)) <= 1e-12 * (1.0 + np.abs(wanted))), case
        assert before == (observer.state, observer.covariance, observer.trust, observer.sticks)
        if delay:
            ways.add(predict(case.x, *under_way[0], arm).way)
    assert not delay or ways == {
        *("stays at rest", "leaves from rest", "slips", "stops and sticks", "stops and leaves")
    }


def test_predictor_sees_no_voltage_before_the_first_command() -> None:
    pair = Pair(counts=4096, period=1e-3)
    pair.start(1.0)
    pair.put(np.array([1.0, 0.5, 2.0, 1.3, 3.0]), np.eye(5), (1.0, 1.0, 0.0, 0.0, 0.0, 1.0))
    context = ObserverContext(pair.model, 1e-3, 4096)
    predictor = FrictionPredictor(pair.observer, context, 1, measured=False)
    got = predictor.ahead(Sample(0.0, 1.0, 0.0), Estimate(1.0, 0.5, 0.0), Reference(1.0, 0.5, 0.0))
    x1p, x2p, d = ahead(pair.reference.x, [(1e-3, 0.0)], pair.reference.arm)
    wanted = (x1p, x2p, compensated(x1p, d, 1.3, 0.5, pair.reference.arm))
    assert tuple(got) == pytest.approx(wanted, rel=1e-12, abs=0)
