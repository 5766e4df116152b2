"""R1, predictor, controller and known friction in C: the bits of the classes of dcmp_hil.control."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from dcmp_hil.control.controllers import ControllerContext
from dcmp_hil.control.controllers.pd_compensated import PdCompensated
from dcmp_hil.control.friction_feedforward import FrictionFeedforward
from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import STEP_TOLERANCE_PERIODS
from dcmp_hil.control.observers.discretisation import matched_gains
from dcmp_hil.control.observers.super_twisting import SuperTwisting, tune
from dcmp_hil.control.predictor import LinearPredictor, held_input
from dcmp_hil.errors import ProtocolError
from dcmp_hil.values import Estimate, Reference, Sample
from tests.firmware.law import Array, Law, T, context, ride, same_bits, table, thinned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.control.observers import ObserverContext
    from tests.firmware.bench import Core

LENGTHS = np.array([T, STEP_TOLERANCE_PERIODS * T])
RESTART, OTHER, NONE = 0, -1, -2


class Gains(NamedTuple):
    """Of R1; None is the rule's."""

    M: float | None = None
    mu0: float | None = None


def _others(samples: Sequence[Sample], rig: ObserverContext, gains: Gains) -> Array:
    """Return the coefficients of the steps that are no whole number of periods, in their order."""
    found, before = [np.zeros(11)], math.nan
    known = tune(rig, L1=4.9, L2=5.51, M=gains.M, mu0=gains.mu0)
    for sample in samples:
        dt = sample.t - before
        if dt <= 0.0:
            continue
        before = sample.t
        n = round(dt / T) if dt < 11 * T else 0
        whole = n >= 1 and abs(dt - n * T) < STEP_TOLERANCE_PERIODS * T
        if not whole and dt < (10 + STEP_TOLERANCE_PERIODS) * T:
            step = tune(rig._replace(period=dt), L1=4.9, L2=5.51, M=known.M, mu0=known.mu0).nominal
            found.append(np.array(step))
    return np.concatenate([*found[1:], found[0]])


def r1_in_c(law: Law, samples: Sequence[Sample], rig: ObserverContext, gains: Gains) -> Array:
    tuning, model = tune(rig, L1=4.9, L2=5.51, M=gains.M, mu0=gains.mu0), rig.model
    steps = [tuning.nominal, *(tuning.gaps[n] for n in range(2, 11))]
    cube = tuning.mu0 * tuning.mu0 * tuning.mu0
    floor_from = tuning.M / cube if cube > 0.0 else math.inf
    numbers = [model.ku, 4.9, 5.51 + model.f0 * 4.9, 4.9 + model.f0, tuning.M, tuning.mu0, floor_from]
    others = _others(samples, rig, gains)
    return law(
        "super_twisting", np.array(numbers), np.array(steps), others, LENGTHS, table(samples, 3), width=3
    )


def _r1_in_python(samples: Sequence[Sample], rig: ObserverContext, gains: Gains) -> Array:
    observer, found = SuperTwisting(rig, M=gains.M, mu0=gains.mu0), []
    for sample in samples:
        try:
            found.append(tuple(observer.update(sample)))
        except ProtocolError:
            found.append((math.nan,) * 3)
    return np.array(found)


def _spoilt(samples: Sequence[Sample]) -> list[Sample]:
    """Return samples with one that is no number, and a gap long enough for a new start after it."""
    return [
        sample._replace(position=math.nan) if k == 400 else sample
        for k, sample in enumerate(samples)
        if not 600 < k < 620
    ]


def _uneven(samples: Sequence[Sample]) -> list[Sample]:
    """Return samples whose time is uneven, stands still or goes back now and then."""
    shifts = {0: 0.3, 50: 0.015, 51: 0.025, 90: -1.0, 170: -3.0}
    return [s._replace(t=s.t + shifts.get(k % 200, 0.0) * T) for k, s in enumerate(samples)]


def _innovations(sizes: Sequence[float], rig: ObserverContext) -> list[Sample]:
    """Return samples of which every second one has an innovation of a given size, rad, to the last bit."""
    h11, found = tune(rig, L1=4.9, L2=5.51, M=None, mu0=None).nominal[6], list[Sample]()
    for k, size in enumerate(sizes):
        near = [size / (1.0 - h11) * (1.0 + n * 1.1e-16) for n in range(-400, 401)]
        y = min(near, key=lambda each: abs(each - h11 * each - size))
        found += [Sample(0.1 * k, 0.0, 0.0), Sample(0.1 * k + T, y, 0.0)]
    return found


def _at_floor(mu0: float) -> tuple[list[Sample], ObserverContext, Gains]:
    """Return a ride with an innovation at the floor, where the sliding gains differ in their last bits."""
    return _innovations([1.0 / (mu0 * mu0 * mu0)], context(None)), context(None), Gains(M=1.0, mu0=mu0)


QUANTISED, IDEAL = ride(), ride(None)
RIG, FINE = context(), context(None)
LEAST = (1e-30, 0.9995e-30, 1.0005e-30, math.nextafter(1e-30, 0.0))  # rad, around the least innovation
AT_THE_FLOOR = Gains(M=1.0, mu0=53.0 / 7.0)  # whose sliding gains there differ in their last bits
FLOOR_FROM = 1.0 / (53.0 / 7.0 * (53.0 / 7.0) * (53.0 / 7.0))  # rad
RIDES: dict[str, tuple[list[Sample], ObserverContext, Gains]] = {
    "quantised": (QUANTISED, RIG, Gains()),
    "ideal": (IDEAL, FINE, Gains()),
    "ideal encoder, no floor": (IDEAL, FINE, Gains(mu0=0.0)),
    "linear": (QUANTISED, RIG, Gains(M=0.0)),
    "neither": (QUANTISED, RIG, Gains(M=0.0, mu0=0.0)),
    "sliding mostly": (QUANTISED, RIG, Gains(M=1000.0, mu0=20.0)),
    "lost samples": (thinned(QUANTISED), RIG, Gains()),
    "lost samples, ideal": (thinned(IDEAL), FINE, Gains()),
    "no number": (_spoilt(IDEAL), FINE, Gains()),
    "uneven": (_uneven(IDEAL), FINE, Gains()),
    "least innovation": (_innovations(LEAST, FINE), FINE, Gains()),
    "innovation at the floor": (_innovations([FLOOR_FROM], FINE), FINE, AT_THE_FLOOR),
    **{f"floor {k} / 7": _at_floor(k / 7.0) for k in (89, 106, 109, 167, 178)},
    "least slope": (IDEAL, FINE, Gains(M=1e-30, mu0=0.0)),
    "at rest": ([Sample(k * T, 0.5, 0.0) for k in range(100)], FINE, Gains()),
}
WANTED = {name: _r1_in_python(*given) for name, given in RIDES.items()}


@pytest.mark.parametrize("name", RIDES)
def test_r1_has_the_bits_of_python(core: Core, name: str) -> None:
    assert same_bits(r1_in_c(Law(core), *RIDES[name]), WANTED[name])


def test_rides_reach_what_they_are_for() -> None:
    lost, uneven = thinned(QUANTISED), _uneven(IDEAL)
    steps = {round((b.t - a.t) / T) for a, b in itertools.pairwise(lost)}
    assert steps >= {1, 2, 3, 6, 10, 101}
    assert np.isnan(WANTED["no number"]).any(axis=1).sum() == 201
    assert np.isnan(WANTED["uneven"]).any(axis=1).sum() > 10
    assert len(_others(uneven, FINE, Gains())) > 11 * 20
    h11 = tune(FINE, L1=4.9, L2=5.51, M=None, mu0=None).nominal[6]
    for name, size in (("least innovation", 1e-30), ("innovation at the floor", FLOOR_FROM)):
        y = RIDES[name][0][1].position
        assert y - h11 * y == size


GAINS_AT = np.concatenate(
    [
        10.0 ** np.random.default_rng(3).uniform(-9.0, 3.0, 2000),
        [0.0, 1e-30, 5e-324, 49.9999, 50.0, math.nextafter(50.0, 99.0), 1e300, math.inf, math.nan],
    ]
)


def test_matched_gains_have_the_bits_of_python(core: Core) -> None:
    wanted = np.array([tuple(matched_gains(x)) for x in GAINS_AT.tolist()])
    assert same_bits(Law(core)("matched_gains", GAINS_AT, width=3), wanted)


@pytest.mark.parametrize(
    ("periods", "wanted"),
    [
        *((n + shift, n) for n in range(1, 11) for shift in (0.0, 0.019, -0.019)),
        *((x, OTHER) for x in (0.5, 1e-9, 0.49, 0.021, 0.979, 1.021, 1.5, 9.979)),
        *((x, RESTART) for x in (10.021, 11.0, 1e9, math.inf, math.nan)),
        *((x, NONE) for x in (0.0, -0.5, -1.0, -1e9, -math.inf)),
    ],
)
def test_periods_of_a_step(core: Core, periods: float, wanted: int) -> None:
    out = core.new("int32_t[1]")
    core.lib.check_step_periods(
        core.new("double[2]", LENGTHS.tolist()), core.new("double[1]", [periods * T]), out, 1
    )
    assert out[0] == wanted


def test_tolerance_of_a_step_is_open(core: Core) -> None:
    out = core.new("int32_t[3]")
    core.lib.check_step_periods(
        core.new("double[2]", [1.0, 0.25]), core.new("double[3]", [1.25, 0.75, 10.25]), out, 3
    )
    assert list(out) == [OTHER, OTHER, RESTART]


def _draws(columns: int, size: float) -> Array:
    return np.random.default_rng(columns).uniform(-size, size, (500, columns))


@pytest.mark.parametrize("f0", [0.0, 1e-6, 0.1, 30.0])
def test_predictor_has_the_bits_of_python(core: Core, f0: float) -> None:
    model, rows = Model(f0=f0), _draws(4, 10.0)
    predictor, found = LinearPredictor(model, T, 1), []
    for *estimate, voltage in rows.tolist():
        predictor.sent(voltage)
        found.append(
            tuple(predictor.ahead(Sample(0.0, 0.0, 0.0), Estimate(*estimate), Reference(0.0, 0.0, 0.0)))
        )
    numbers = np.array([*held_input(f0, T), model.ku])
    assert same_bits(Law(core)("ahead", numbers, rows, width=3), np.array(found))


@pytest.mark.parametrize("compensate", [True, False])
def test_controller_has_the_bits_of_python(core: Core, compensate: bool) -> None:
    model, rows = Model(), _draws(6, 5.0)
    controller = PdCompensated(ControllerContext(model, T), compensate=compensate)
    wanted = [controller.update(Reference(*row[:3]), Estimate(*row[3:])) for row in rows.tolist()]
    numbers = np.array([4000.0, 130.0, float(compensate), model.f0, 1.0 / model.ku])
    assert same_bits(Law(core)("pd_voltage", numbers, rows), np.array(wanted))


def test_known_friction_has_the_bits_of_python(core: Core) -> None:
    model, rows = Model(), _draws(2, 0.01)
    rows[:8, 0] = [0.0, 0.005, -0.005, 0.006, -0.006, math.inf, -math.inf, math.nan]
    wanted = []
    for velocity, voltage in rows.tolist():
        known = FrictionFeedforward(model)
        told = known.told(Sample(1.0, 0.0, voltage), velocity)
        whole = known.whole(Estimate(2.0, 3.0, 1.0), velocity)
        friction = known.whole(Estimate(0.0, 0.0, 0.0), velocity).disturbance
        wanted.append((friction, told.voltage, *whole))
    got = Law(core)("known_friction", model.f1, 1.0 / model.ku, rows, width=5)
    assert same_bits(got + 0.0, np.array(wanted) + 0.0)  # 0 - 0 in Python is -0 here


SINGLE = {  # rad, rad/s and rad/s2: largest distance of float from double over 4 s of a ride
    "quantised": (1e-5, 1e-3, 0.05),
    "ideal": (1e-6, 1e-3, 0.5),  # its bandwidth is 300 rad/s
    "lost samples": (1e-6, 1e-4, 0.01),
    "at rest": (0.0, 0.0, 0.0),
}


@pytest.mark.parametrize("name", SINGLE)
def test_r1_in_single_precision_stays_near_that_in_double(core: Core, name: str) -> None:
    got = r1_in_c(Law(core, "float_"), *RIDES[name])
    apart = np.abs(got - WANTED[name]).max(axis=0)
    assert (apart <= SINGLE[name]).all()


def test_the_rest_in_single_precision(core: Core) -> None:
    single, law = Law(core, "float_"), Law(core)
    x = 10.0 ** np.linspace(-4.0, 3.0, 2000)
    gains, wanted = single("matched_gains", x, width=3), law("matched_gains", x, width=3)
    assert np.abs(gains / wanted - 1.0).max() < 4e-6
    rows = _draws(4, 10.0)
    numbers = np.array([*held_input(0.1, T), 5.4])
    assert single("ahead", numbers, rows, width=3) == pytest.approx(
        law("ahead", numbers, rows, width=3), abs=2e-6
    )
