"""The written-out covariance of R6 against dense matrices, and what it must stay."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.control.observers.friction_kalman.covariance import (
    Covariance,
    released,
    slipped,
    stuck,
    widened,
)
from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
from dcmp_hil.values import Sample
from tests.control.observers.friction_pair import Pair, full, upper
from tests.control.observers.friction_reference_motion import (
    Arm,
    Matrix,
    Motion,
    drift_matrix,
    leak_matrix,
    slip_matrix,
    spread,
)
from tests.helpers import T, setting

if TYPE_CHECKING:
    from collections.abc import Sequence

_ARM = Arm(g=14.03, f0=0.1, f1=1.3, q=2.0 * np.pi / 4096.0, period=T)
_SUBNORMAL = 1e-300
"""Numbers below it have fewer digits than the relative bound asks for."""
_numbers = st.floats(-1.0, 1.0)
_scales = st.floats(-4.0, 2.0).map(lambda power: 10.0**power)


@st.composite
def _covariances(draw: st.DrawFn) -> Matrix:
    """Draw a positive semidefinite P; every state has a scale of its own."""
    rank = draw(st.integers(1, 5))
    root = np.array(draw(st.lists(_numbers, min_size=5 * rank, max_size=5 * rank))).reshape(5, rank)
    return np.asarray(_outer(root * np.array(draw(st.tuples(*[_scales] * 5)))[:, None]))


def _outer(root: Matrix) -> Matrix:
    p = root @ root.T
    return np.asarray(0.5 * (p + p.T))


def _packed(p: Matrix) -> Covariance:
    p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, *rest = upper(p)
    p23, p24, p33, p34, p44 = rest
    return p00, p01, p02, p03, p04, p11, p12, p13, p14, p22, p23, p24, p33, p34, p44


def _close(got: Sequence[float], wanted: Matrix, size: Matrix) -> None:
    """Compare at 1e-12 of `size`, the sum of the absolute values of all products that make an element."""
    off = np.abs(full(tuple(got)) - wanted)
    assert np.all(off <= 1e-12 * size + _SUBNORMAL), off


@settings(deadline=None, max_examples=300)
@given(
    p=_covariances(),
    x1=st.floats(-7.0, 7.0),
    direction=st.sampled_from([-1.0, 1.0]),
    step=st.floats(2e-5, 0.04),
    m=st.floats(1.0, 300.0),
)
def test_covariance_of_a_slip_equals_dense_matrices(
    p: Matrix, x1: float, direction: float, step: float, m: float
) -> None:
    motion = Motion(np.array([x1, direction, 0.0, 1.3, 0.0]), 0.0, direction, stuck=False, way="")
    noise = 0.1 * step * m, 1e-3 * step, 5.0 * step * 7.0
    got = slipped(_packed(p), x1, direction, step, _ARM.f0, _ARM.g, noise)
    matrices = drift_matrix(step) @ leak_matrix(step) @ slip_matrix(motion, step, _ARM)
    noise_alone = spread(np.zeros((5, 5)), motion, step, _ARM, m=m, ms=7.0)
    size = np.abs(matrices) @ np.abs(p) @ np.abs(matrices).T + np.abs(noise_alone)
    _close(got, spread(p, motion, step, _ARM, m=m, ms=7.0), size)


@settings(deadline=None, max_examples=200)
@given(p=_covariances(), step=st.floats(2e-5, 0.04), m=st.floats(1.0, 300.0))
def test_covariance_of_a_stuck_step_equals_dense_matrices(p: Matrix, step: float, m: float) -> None:
    motion = Motion(np.array([1.0, 0.0, 0.0, 1.3, 0.0]), 0.0, 0.0, stuck=True, way="")
    noise = (0.1 * m + 1.0) * step, 1e-3 * step * (30.0 * m - 29.0), 5.0 * step * 7.0
    got = stuck(_packed(p), step, noise)
    matrices = drift_matrix(step) @ leak_matrix(step)
    noise_alone = spread(np.zeros((5, 5)), motion, step, _ARM, m=m, ms=7.0)
    size = np.abs(matrices) @ np.abs(p) @ np.abs(matrices).T + np.abs(noise_alone)
    _close(got, spread(p, motion, step, _ARM, m=m, ms=7.0), size)


@settings(deadline=None, max_examples=100)
@given(p=_covariances(), e=st.floats(-0.1, 0.1), x2=_numbers, age=st.floats(1e-3, 0.1))
def test_released_and_widened_covariances_equal_dense_matrices(
    p: Matrix, e: float, x2: float, age: float
) -> None:
    wanted = p.copy()
    wanted[0, 0] += e * e
    wanted[1, 1] = x2 * x2
    wanted[2, 2] += 1.3**2
    _close(released(_packed(p), e, x2, 1.3), wanted, np.abs(wanted))
    v = np.array([0.5 * age * age, age, 1.0, 0.0, 0.0])
    wanted = p + 50.0 * np.outer(v, v)
    _close(widened(_packed(p), age, 50.0), wanted, np.abs(p) + 50.0 * np.outer(v, v))


@settings(deadline=None, max_examples=200)
@given(
    root=st.lists(_numbers, min_size=15, max_size=15),
    x2=st.floats(0.2, 3.0),
    periods=st.floats(0.1, 10.0),
    rise=st.sampled_from([0, 0, 1, 2]),
    off=st.floats(0.6, 2.0),
)
def test_covariance_after_a_correction_equals_dense_matrices(
    root: list[float], x2: float, periods: float, rise: int, off: float
) -> None:
    q = _ARM.q
    scales = np.array([3.0 * q, 0.3, 3.0, 0.3, 3.0])
    p = _outer(np.array(root).reshape(5, 3) * scales[:, None])
    pair = Pair(counts=4096, period=T)
    pair.start(0.0)
    step = periods * T
    pair.put(np.array([(rise + off) * q - step * x2, x2, 0.0, 1.3, 0.0]), p, (1.0, 1.0, 0.0, 0.0, 0.0, 1.0))
    pair.step(step, rise * q, 0.0)
    reached = pair.reference.reached
    assert "slips" in reached
    assert "step hypothesis" not in reached
    assert ("edge up" in reached) == (rise > 0)
    # A correction takes away no more than there was: the diagonal before it is the size of what cancels.
    motion = Motion(pair.reference.x, 0.0, 1.0, stuck=False, way="")
    deviations = np.sqrt(np.diag(spread(p, motion, step, _ARM, m=1.0, ms=1.0)))
    _close(pair.observer.covariance, pair.reference.p, np.outer(deviations, deviations))


@pytest.mark.parametrize("counts", [256.0, 4096.0, 65536.0])
def test_covariance_stays_positive_semidefinite_over_random_steps(counts: float) -> None:
    draw = np.random.default_rng(5)
    observer = FrictionKalman(setting(counts=counts))
    q, steps = 2.0 * np.pi / counts, 33_400
    periods = np.where(draw.random(steps) < 0.5, draw.integers(1, 11, steps), draw.uniform(1.0, 10.0, steps))
    rises = draw.integers(-3, 4, steps) * (draw.random(steps) < 0.4) * draw.integers(1, 4, steps)
    # Stretches of one direction, of scatter, and of rest.
    course = np.repeat(draw.choice([0, 1, 1, -1], steps // 50 + 1), 50)[:steps]
    counted = np.cumsum(np.where(course == 1, np.abs(rises), course * np.abs(rises) + (course == 0) * rises))
    volts = np.repeat(draw.uniform(-10.0, 10.0, steps // 20 + 1), 20)[:steps]
    samples = zip((np.cumsum(periods) * T).tolist(), (counted * q).tolist(), volts.tolist(), strict=True)
    taken = list[tuple[float, ...]]()
    stuck_steps = 0
    for k, (t, y, voltage) in enumerate(samples):
        observer.update(Sample(t, y, voltage))
        stuck_steps += observer.sticks
        if k % 10 == 0:
            taken.append(observer.covariance)
    p = np.array([full(one) for one in taken])
    deviations = np.sqrt(np.diagonal(p, axis1=1, axis2=2))
    assert np.all(deviations > 0.0)
    correlations = p / (deviations[:, :, None] * deviations[:, None, :])
    assert np.linalg.eigvalsh(correlations).min() > -1e-12
    assert observer.steps > 0
    assert stuck_steps > 10
