"""The friction Kalman filter in C: the bits of the Python class, its covariance, trust and prediction too."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from dcmp_hil.control.model import Model
from dcmp_hil.control.observers.friction_kalman.motion import moved
from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
from dcmp_hil.control.observers.friction_kalman.predictor import FrictionPredictor
from dcmp_hil.control.observers.friction_kalman.trust import judged, stepped
from dcmp_hil.errors import ProtocolError
from dcmp_hil.values import Estimate, Reference, Sample
from tests.firmware.law import Array, Law, T, context, reference, ride, same_bits, thinned
from tests.helpers import spoilt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.firmware.bench import Core

WIDTH = 34
STEPS = 30  # its column
SETUP: tuple[str, ...] = (
    "_f0",
    "_gravity",
    "_ku",
    "_f1",
    "_f_max",
    "_f1_variance",
    "_q",
    "_half_count",
    "_restart_after",
)
SETUP += ("_unchanged_variance", "_edge_variance", "_d_noise")


class Settings(NamedTuple):
    """Of the filter and its predictor."""

    counts: float = 4096.0
    d_noise: float = 0.1
    delay: int = 1
    f1: float = 1.3


def _made(settings: Settings) -> tuple[FrictionKalman, FrictionPredictor]:
    rig = context(settings.counts, model=Model(f1=settings.f1))
    observer = FrictionKalman(rig, d_noise=settings.d_noise)
    return observer, FrictionPredictor(observer, rig, settings.delay, measured=False)


def in_python(samples: Sequence[Sample], settings: Settings) -> Array:
    """Return what the check in C puts out: estimate, state, covariance, trust, sticks, steps, state ahead."""
    observer, predictor = _made(settings)
    found = list[tuple[float, ...]]()
    estimate = Estimate(math.nan, math.nan, math.nan)
    for sample, (_, _, _, voltage, velocity) in zip(samples, _rows(samples).tolist(), strict=True):
        try:
            estimate = observer.update(sample)
        except ProtocolError:
            found.append(found[-1])
            continue
        predictor.sent(voltage)
        ahead = predictor.ahead(sample, estimate, Reference(0.0, velocity, 0.0))
        inside = (*observer.state, *observer.covariance, *observer.trust, observer.sticks, observer.steps)
        found.append((*estimate, *map(float, inside), *ahead))
    return np.array(found)


def _rows(samples: Sequence[Sample]) -> Array:
    """Return time, position, voltage, that under way, and the reference's velocity."""
    return np.array(
        [(s.t, s.position, s.voltage, 0.5 + s.voltage, 0.05 * reference(s.t).velocity) for s in samples]
    )


def in_c(law: Law, samples: Sequence[Sample], settings: Settings) -> Array:
    setup = vars(_made(settings)[0])
    numbers = np.array([setup[name] for name in SETUP])
    return law("friction_kalman", numbers, T, settings.delay, _rows(samples), width=WIDTH)


def _spoilt(samples: Sequence[Sample], field: str) -> list[Sample]:
    """Return samples with one that is no number, and a gap long enough for a new start after it."""
    return [
        spoilt(sample, field, math.inf) if k == 400 else sample
        for k, sample in enumerate(samples)
        if not 600 < k < 620
    ]


def _wiped(samples: Sequence[Sample]) -> list[Sample]:
    """Return samples of an encoder that loses two counts now and then, and jumps by many once."""
    q = 2.0 * math.pi / 4096.0
    return [
        s._replace(position=s.position + q * (2.0 * (k % 97 == 50) + 400.0 * (k > 2100)))
        for k, s in enumerate(samples)
    ]


QUIET, PUSHED, FINE = ride(), ride(push=6.0), ride(65536.0)
RESTING = [Sample(k * T, 0.5 * (k > 900), 0.02 * math.sin(0.01 * k)) for k in range(1500)]
RIDES: dict[str, tuple[list[Sample], Settings]] = {
    "quiet": (QUIET, Settings()),
    "pushed": (PUSHED, Settings()),
    "pushed, no delay": (PUSHED, Settings(delay=0)),
    "pushed, slow filter": (PUSHED, Settings(d_noise=1e-4)),
    "fine encoder": (FINE, Settings(counts=65536.0)),
    "coarse encoder": (ride(256.0, push=4.0), Settings(counts=256.0)),
    "lost samples": (thinned(PUSHED), Settings()),
    "wrong counts": (_wiped(QUIET), Settings()),
    "wrong friction": (QUIET, Settings(f1=0.2)),
    "at rest": (RESTING, Settings()),
    "far away": (
        [*QUIET[:300], *(s._replace(position=s.position + 1e13) for s in QUIET[300:350])],
        Settings(),
    ),
    "no position": (_spoilt(QUIET, "position"), Settings()),
    "no voltage": (_spoilt(QUIET, "voltage"), Settings()),
}
WANTED = {name: in_python(*given) for name, given in RIDES.items()}


@pytest.mark.parametrize("name", RIDES)
def test_filter_and_prediction_have_the_bits_of_python(core: Core, name: str) -> None:
    assert same_bits(in_c(Law(core), *RIDES[name]), WANTED[name])


def test_time_that_does_not_advance_is_a_new_start(core: Core) -> None:
    samples = [*QUIET[:50], QUIET[49]._replace(position=0.25), QUIET[3]._replace(position=0.5)]
    got = in_c(Law(core), samples, Settings())
    first = in_c(Law(core), [Sample(0.0, 0.25, 0.0)], Settings(delay=0))
    assert same_bits(got[50, :31], first[0, :31])
    assert got[51, :3].tolist() == [0.5, 0.0, 0.0]


def test_rides_reach_what_they_are_for() -> None:
    sticks = {name: wanted[:, STEPS - 1].any() for name, wanted in WANTED.items()}
    assert sticks["quiet"]
    assert sticks["at rest"]
    assert max(wanted[:, STEPS].max() for wanted in WANTED.values()) > 0
    assert max(np.nanmax(wanted[:, 23]) for wanted in WANTED.values()) == 300.0  # of m
    assert max(np.nanmax(wanted[:, 28]) for wanted in WANTED.values()) > 1.5  # of the edges' scatter


def _motions() -> Array:
    """Return arguments of a step: any, from rest, at the edge of friction, and such as come to rest in it."""
    draw = np.random.default_rng(5)
    n = 3000
    x1, x2 = draw.uniform(-7.0, 7.0, n), draw.uniform(-0.02, 0.02, n) * draw.integers(0, 2, n)
    d, f, s = draw.uniform(-3.0, 3.0, n), draw.uniform(0.0, 3.0, n), draw.uniform(-30.0, 30.0, n)
    step, u = draw.uniform(0.1, 10.0, n) * T, 14.03 * np.sin(x1) + draw.uniform(-3.0, 3.0, n)
    rows = np.column_stack([x1, x2, d, f, s, step, u, np.full(n, 0.1), np.full(n, 14.03)])
    edges = [
        (0.0, 0.0, sign * a, 1.5, 0.0, T, 0.0, 0.1, 14.03) for sign in (1, -1) for a in (1.5, 1.5 + 1e-12)
    ]
    ends = [(0.0, sign * 1.0, 0.0, 3.0, 0.0, 0.5, 0.0, 0.0, 0.0) for sign in (1.0, -1.0)]  # 1/3 s to rest
    turns = [(0.0, sign, -sign * 6.0, 3.0, 0.0, 0.5, 0.0, 0.0, 0.0) for sign in (1.0, -1.0)]
    still = [(0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0, 0.0, 0.0)]  # the velocity is 0 exactly at the end
    least = [
        (0.0, 0.0, sign * 5e-324, 0.0, 0.0, T, 0.0, 0.0, 0.0) for sign in (1.0, -1.0)
    ]  # no velocity of it
    return np.concatenate([rows, np.array(edges + ends + turns + still + least)])


def test_a_step_of_the_arm_has_the_bits_of_python(core: Core) -> None:
    rows = _motions()
    wanted = np.array([moved(*row) for row in rows.tolist()])
    assert same_bits(Law(core)("moved", rows, width=6), wanted)
    moving = rows[:, 1] != 0.0
    assert (wanted[moving, 5] == 0.0).any()
    assert (np.sign(rows[moving, 1]) * wanted[moving, 5] < 0.0).any()


def _edges() -> Array:
    """Return arguments of an edge: of an arm that moves, or that stuck, with any covariance and trust."""
    draw = np.random.default_rng(9)
    n = 4000
    spread = 10.0 ** draw.uniform(-4.0, 0.0, (n, 5))
    like = draw.uniform(-0.3, 0.3, (n, 5, 5))
    covariance = spread[:, :, None] * spread[:, None, :] * np.where(np.eye(5) > 0.0, 1.0, like)
    upper = covariance[:, *np.triu_indices(5)]
    state = draw.uniform(-1.0, 1.0, (n, 5)) * (0.2, 0.3, 3.0, 2.0, 30.0) + (0.0, 0.0, 0.0, 2.0, 0.0)
    trust = draw.uniform(-1.0, 1.0, (n, 6)) * (9.0, 0.0, 3.0, 1.0, 3.0, 10.0) + (
        10.0,
        1.0,
        3.0,
        0.0,
        0.0,
        11.0,
    )
    t, step = draw.uniform(0.1, 1.0, n), draw.uniform(0.1, 30.0, n) * T
    since = step * draw.uniform(0.5, 4.0, n)
    rest = [draw.uniform(-3.0, 3.0, n), draw.integers(0, 2, n), t, t - since, draw.uniform(-0.3, 0.3, n)]
    return np.column_stack([state, upper, trust, *rest, draw.choice([-2.0, -1.0, 1.0, 2.0], n), step])


def _by_edge_in_python(observer: FrictionKalman, row: list[float]) -> tuple[float, ...]:
    a, sticks, t, edge_t, y, rise, step = row[26:]
    vars(observer).update(trust=(*row[20:26],), sticks=sticks > 0.0, steps=0, _t=t, _edge_t=edge_t, _y=y)
    by_edge = vars(FrictionKalman)["_by_edge"]
    state = by_edge(observer, (*row[:5],), (*row[5:20],), a, int(rise), step)
    return (*state, *observer.covariance, *observer.trust, float(observer.sticks), float(observer.steps))


@pytest.mark.parametrize("counts", [4096.0, 64.0])
def test_an_edge_has_the_bits_of_python(core: Core, counts: float) -> None:
    rows = _edges()
    observer, _ = _made(Settings(counts=counts))
    setup = np.array([vars(observer)[name] for name in SETUP])
    wanted = np.array([_by_edge_in_python(observer, row) for row in rows.tolist()])
    assert same_bits(Law(core)("by_edge", setup, rows, width=28), wanted)
    assert (wanted[:, 27] > 0.0).sum() > 100  # steps
    assert ((rows[:, 27] > 0.0) & (wanted[:, 26] == 0.0)).sum() > 100  # released


def _trusts() -> Array:
    """Return arguments of a judgement: any, and some at each of its bounds."""
    draw = np.random.default_rng(6)
    n = 3000
    m = np.where(draw.integers(0, 3, n) > 0, 10.0 ** draw.uniform(0.0, 2.5, n), 1.0)
    calm, slow, fast = draw.uniform(0.0, 300.0, n), draw.uniform(-1.0, 1.0, n), draw.uniform(-3.0, 3.0, n)
    scatter, nu = draw.uniform(1.0, 30.0, n), draw.normal(0.0, 3.0, n)
    rows = [
        m,
        np.ones(n),
        calm,
        slow,
        fast,
        scatter,
        nu,
        draw.uniform(0.1, 3.0, n) * T,
        draw.integers(0, 2, n),
    ]
    even = np.column_stack(rows)
    bounds = [
        (m, 1.0, calm, slow, 1.0, scatter, nu, T, 1.0)
        for m in (1.0, 9.99, 10.0, 300.0)
        for calm in (0.0, 250.0, 260.0)
        for slow in (0.0, 0.2, -0.2, 1.0, -1.0)
        for scatter in (1.0, 30.0)
        for nu in (0.0, 4.0, -4.0, 4.1, -4.1, 3.0, 1e9, math.nan)
    ]
    return np.concatenate([even, np.array(bounds)])


def test_trust_has_the_bits_of_python(core: Core) -> None:
    rows = _trusts()
    wanted = [judged((*row[:6],), row[6], row[7], row[8] > 0.0) for row in rows.tolist()]
    assert same_bits(Law(core)("judged", rows, width=6), np.array(wanted))


def test_a_step_of_the_disturbance_is_assumed_at_the_same_means_and_innovations(core: Core) -> None:
    bound = math.sqrt(30.0 / 9.0)
    means = [sign * bound * (1.0 + off) for sign in (1.0, -1.0) for off in (-0.1, -1e-4, 1e-4, 0.1)]
    sizes = (0.0, 0.999, 1.0, math.nextafter(1.0, 2.0), 3.0)
    rows = np.array([(mean, sign * size) for mean in means for sign in (1.0, -1.0) for size in sizes])
    wanted = np.array([float(stepped(mean, nu)) for mean, nu in rows.tolist()])
    assert set(wanted.tolist()) == {0.0, 1.0}
    assert same_bits(Law(core)("stepped", rows), wanted)


@pytest.mark.parametrize(("name", "bounds"), [("quiet", (2e-6, 1e-4, 2e-3)), ("at rest", (1e-5, 1e-3, 0.03))])
def test_filter_in_single_precision(core: Core, name: str, bounds: tuple[float, ...]) -> None:
    samples, settings = RIDES[name]
    got = in_c(Law(core, "float_"), samples[:1000], settings)
    apart = np.abs(got[:, :3] - WANTED[name][:1000, :3]).max(axis=0)
    assert (apart <= bounds).all()
