"""The observer and its independent reference side by side, and random states for both."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
from dcmp_hil.values import Estimate, Sample
from tests.control.observers.friction_reference import FrictionReference
from tests.control.observers.friction_reference_motion import Arm, Matrix, Vector

if TYPE_CHECKING:
    from numpy.random import Generator

_UPPER = np.triu_indices(5)
_COUNTS = (256, 1024, 4096, 10000, 65536)


def upper(p: Matrix) -> tuple[float, ...]:
    """Return the upper triangle of P, row by row, as the observer holds it."""
    return tuple(float(value) for value in p[_UPPER])


def full(p: tuple[float, ...]) -> Matrix:
    """Return P from its upper triangle."""
    whole = np.zeros((5, 5))
    whole[_UPPER] = p
    return whole + np.triu(whole, 1).T


class Pair:
    """The observer and the reference of one rig, given the same samples."""

    def __init__(self, *, counts: float, period: float, model: Model | None = None) -> None:
        model = Model() if model is None else model
        self.model = model
        self.observer = FrictionKalman(ObserverContext(model, period, counts))
        self.reference = FrictionReference(
            Arm(g=model.gravity, f0=model.f0, f1=model.f1, q=2.0 * np.pi / counts, period=period)
        )
        self.t = self.y = 0.0

    def start(self, y: float) -> None:
        """Give both the first sample, rad."""
        self.y = y
        self.observer.update(Sample(self.t, y, 0.0))
        self.reference.start(y)

    def step(self, dt: float, y: float, voltage: float) -> tuple[Estimate, tuple[float, float, float]]:
        """Give both the next sample, `dt` s later, and return both estimates."""
        before, self.t, self.y = self.t, self.t + dt, y
        estimate = self.observer.update(Sample(self.t, y, voltage))
        return estimate, self.reference.step(self.t - before, y, self.model.ku * voltage)

    def put(self, x: Vector, p: Matrix, trust: tuple[float, float, float, float, float, float]) -> None:
        """Set the state of both; `trust` is m, ms, mb, slow, fast, rho."""
        x1, x2, d, f, s = (float(value) for value in x)
        self.observer.state = x1, x2, d, f, s
        p00, p01, p02, p03, p04, p11, p12, p13, p14, *rest = upper(p)
        p22, p23, p24, p33, p34, p44 = rest
        self.observer.covariance = (
            *(p00, p01, p02, p03, p04, p11, p12, p13, p14),
            *(p22, p23, p24, p33, p34, p44),
        )
        self.observer.trust = trust
        reference = self.reference
        reference.x, reference.p = x.copy(), p.copy()
        reference.m, reference.ms, reference.mb, reference.slow, reference.fast, reference.rho = trust

    def differences(self, tolerance: float) -> list[str]:
        """Name everything in which they differ by more than `tolerance` (1 + |value|)."""
        got, wanted = self._inside()
        off = np.abs(got - wanted) > tolerance * (1.0 + np.abs(wanted))
        found = [
            f"{name}: {a!r}, and {b!r}"
            for name, a, b, bad in zip(_NAMES, got, wanted, off, strict=True)
            if bad
        ]
        observer, reference = self.observer, self.reference
        if observer.sticks != reference.stuck:
            found.append(f"sticks: {observer.sticks}")
        if observer.steps != reference.hypotheses:
            found.append(f"steps: {observer.steps}, and {reference.hypotheses}")
        if not np.isfinite(got).all():
            found.append("not finite")
        return found

    def _inside(self) -> tuple[Vector, Vector]:
        reference = self.reference
        trust = (reference.m, reference.ms, reference.mb, reference.slow, reference.fast, reference.rho)
        observer = self.observer
        return (
            np.array([*observer.state, *observer.trust, *observer.covariance]),
            np.array([*reference.x, *trust, *upper(reference.p)]),
        )


_NAMES = (
    *("x1", "x2", "d", "f", "s"),
    *("m", "ms", "mb", "slow", "fast", "rho"),
    *(f"P{i}{j}" for i, j in zip(*_UPPER, strict=True)),
)


class Case(NamedTuple):
    """A random state, and the sample that follows it."""

    x: Vector
    p: Matrix
    trust: tuple[float, float, float, float, float, float]
    dt: float
    rise: int  # counts
    voltage: float


def random_pair(draw: Generator) -> Pair:
    """Return a pair with a random encoder and period, some samples and counts after its start."""
    pair = Pair(counts=float(draw.choice(_COUNTS)), period=float(draw.choice([2e-4, 1e-3, 4e-3])))
    arm = pair.reference.arm
    pair.start(round(draw.uniform(-1000.0, 1000.0)) * arm.q)
    for _ in range(draw.integers(0, 4)):
        pair.step(arm.period * draw.uniform(0.1, 10.0), pair.y + int(draw.choice([0, 0, 1, -1])) * arm.q, 0.0)
    return pair


def random_covariance(draw: Generator, q: float) -> Matrix:
    """Return a random positive semidefinite P of rank 1 to 5, in units that fit an encoder of `q` rad."""
    deviations = np.array([q, 0.1, 3.0, 0.5, 3.0]) * 10.0 ** draw.uniform(-1.5, 0.5, 5)
    root = draw.normal(size=(5, draw.integers(1, 6))) * deviations[:, None]
    return np.asarray(root @ root.T / root.shape[1], np.float64)


def random_case(draw: Generator, pair: Pair) -> Case:
    """Return a state and a sample; their kinds reach every branch of a step often."""
    arm = pair.reference.arm
    if arm.q > 5e-3 and draw.random() < 0.4:
        return _stepped(draw, pair)
    dt = arm.period * float(draw.choice([1.0, 2.0, draw.uniform(0.1, 10.0), draw.uniform(5.0, 10.0)]))
    voltage = float(draw.choice([0.0, draw.uniform(-10.0, 10.0)]))
    rise = int(draw.choice([0, 0, 1, -1, 1, -1, int(draw.integers(-9, 10)), int(draw.integers(-60, 61))]))
    speed = draw.choice([0.0, draw.normal(0.0, 0.003), draw.normal(0.0, 0.1), draw.normal(0.0, 3.0)])
    f = draw.choice([0.02 * draw.random(), arm.f1, draw.uniform(0.0, 4.0), 3.95 + 0.05 * draw.random()])
    y = pair.y + rise * arm.q
    x1 = y - 0.5 * np.sign(rise) * arm.q + arm.q * draw.normal(0.0, draw.choice([0.05, 0.5, 3.0]))
    d = draw.normal(0.0, 8.0)
    if draw.random() < 0.5:  # what drives it is near the friction: it sticks, or just does not
        others = arm.g * np.sin(x1 + 0.5 * dt * speed) - pair.model.ku * voltage + arm.f0 * speed
        d = others + draw.uniform(-1.3, 1.3) * f
    x = np.array([x1, speed, d, f * (arm.f1 if f > arm.f1 else 1.0), draw.normal(0.0, 5.0)])
    p = random_covariance(draw, arm.q)
    if speed == 0.0:
        p[1, :] = p[:, 1] = 0.0
    return Case(x, p, _random_trust(draw, np.sign(y - x1)), dt, rise, voltage)


def _stepped(draw: Generator, pair: Pair) -> Case:
    """Return a calm state that moves slowly, and an edge that only a step of d explains."""
    arm = pair.reference.arm
    dt = arm.period * draw.uniform(1.0, 10.0)
    side, sg = draw.choice([-1.0, 1.0], 2)
    rise = int(draw.choice([-2, -1, 1, 2]))
    speed, f, voltage = sg * draw.uniform(0.1, 0.5), arm.f1, draw.uniform(-1.0, 1.0)
    edge = pair.y + (rise - 0.5 * np.sign(rise)) * arm.q
    x1 = edge - side * arm.q * draw.uniform(0.0, 12.0) - 0.5 * dt * speed
    d = arm.g * np.sin(x1 + 0.5 * dt * speed) - pair.model.ku * voltage + sg * f
    x = np.array([x1, speed, d, f, draw.normal(0.0, 1.0)])
    trust = (1.0, 1.0, draw.uniform(0.0, 3.0), 0.0, side * draw.uniform(1.5, 4.0), 1.0)
    return Case(x, random_covariance(draw, 0.3 * arm.q), trust, dt, rise, voltage)


def _random_trust(draw: Generator, side: float) -> tuple[float, float, float, float, float, float]:
    """Return m, ms, mb, slow, fast, rho; half of the fast means lie on the side of the innovation to come."""
    m = draw.choice([1.0, draw.uniform(1.0, 12.0), draw.uniform(1.0, 300.0), 300.0])
    mb = draw.choice([0.0, draw.uniform(0.0, 4.0), draw.uniform(0.0, 300.0)])
    slow = draw.choice([draw.normal(0.0, 0.1), draw.normal(0.0, 0.4), draw.uniform(-4.0, 4.0)])
    fast = draw.choice([draw.normal(0.0, 0.4), draw.uniform(-4.0, 4.0), side * draw.uniform(1.5, 4.0)])
    rho = draw.choice([1.0, draw.uniform(1.0, 3.0), draw.uniform(1.0, 30.0), 30.0])
    ms = draw.choice([1.0, draw.uniform(1.0, 100.0)])
    return float(m), float(ms), float(mb), float(slow), float(fast), float(rho)
