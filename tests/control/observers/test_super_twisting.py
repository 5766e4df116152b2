"""R1: each step of theory.md section 4, lost samples, and what must not raise."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.control.observers.super_twisting import SuperTwisting, bandwidth_floor, slope_bound
from dcmp_hil.errors import ProtocolError
from dcmp_hil.values import Estimate, Sample
from tests.control.observers.matrix_observer import L1, L2, MatrixObserver
from tests.helpers import T, setting, spoilt

_steps = st.lists(
    st.tuples(
        st.one_of(
            st.just(1.0), st.sampled_from(range(1, 11)), st.floats(0.1, 0.97), st.floats(1.03, 9.9)
        ),  # periods; 2 % around 1, 2, 3 ... belongs to the whole number
        st.floats(-3.0, 3.0),  # rad
        st.floats(-10.0, 10.0),  # V
    ),
    min_size=1,
    max_size=30,
)


def _off_nominal(periods: float) -> bool:
    return periods == round(periods) or abs(periods - round(periods)) > 0.025


@settings(deadline=None, max_examples=60)
@given(
    steps=_steps,
    M=st.sampled_from([0.0, 15.0, 1000.0]),
    mu0=st.sampled_from([0.0, 40.0, 100.0]),
    f0=st.sampled_from([0.0, 0.1, 5.0]),
)
def test_super_twisting_equals_matrices_when_steps_and_gaps_vary(
    steps: list[tuple[float, float, float]], M: float, mu0: float, f0: float
) -> None:
    observer = SuperTwisting(setting(f0=f0), M=M, mu0=mu0)
    reference = MatrixObserver(f0=f0, M=M, mu0=mu0)
    t = 0.0
    observer.update(Sample(t, 0.3, 0.0))
    reference.start(0.3)
    for periods, y, voltage in steps:
        if not _off_nominal(periods):
            continue
        before, t = t, t + periods * T
        got = observer.update(Sample(t, y, voltage))
        expected = reference.step(t - before, y, voltage)
        # Velocity and disturbance scale with y/T and y/T^2: the tolerances are 1e-8 of those.
        assert got.position == pytest.approx(expected[0], rel=1e-8, abs=1e-8)
        assert got.velocity == pytest.approx(expected[1], rel=1e-8, abs=1e-5)
        assert got.disturbance == pytest.approx(expected[2], rel=1e-8, abs=1e-2)


@pytest.mark.parametrize("M", [15.0, 1000.0])
@pytest.mark.parametrize("y", [1e-12, 1e-9, 1e-6, 2e-5, 2e-4, 2.4e-4, 1e-3, 1e-2, 0.1])  # rad
def test_super_twisting_slides_when_the_innovation_is_below_the_floors(y: float, M: float) -> None:
    # The two meet at b = M / mu0^3: 2.3e-4 rad with M = 15, 1.6e-2 rad with M = 1000, mu0 = 40 rad/s.
    observer, reference = SuperTwisting(setting(), M=M), MatrixObserver(f0=0.1, M=M, mu0=40.0)
    observer.update(Sample(0.0, 0.0, 0.0))
    reference.start(0.0)
    for k in range(1, 4):
        got = observer.update(Sample(k * T, k * k * y, 0.0))
        assert tuple(got) == pytest.approx(reference.step(T, k * k * y, 0.0), rel=1e-7, abs=0)


@pytest.mark.parametrize("lost", range(1, 10))
def test_super_twisting_takes_the_longer_step_when_samples_are_lost(lost: int) -> None:
    # M = 0 is linear: position within 1e-12, disturbance within 1e-8 of the exact solution over the gap.
    observer, reference = SuperTwisting(setting(), M=0.0), MatrixObserver(f0=0.1, M=0.0, mu0=40.0)
    observer.update(Sample(0.0, 0.1, 0.0))
    reference.start(0.1)
    ticks = [1, 2, 3 + lost, 4 + lost]
    for before, tick in itertools.pairwise([0, *ticks]):
        y = 0.1 + 0.02 * tick
        got = observer.update(Sample(tick * T, y, 1.5))
        expected = reference.step((tick - before) * T, y, 1.5)
        assert got.position == pytest.approx(expected[0], abs=1e-12)
        assert got.velocity == pytest.approx(expected[1], rel=1e-9, abs=0)
        assert got.disturbance == pytest.approx(expected[2], rel=1e-9, abs=1e-8)


def test_super_twisting_stays_exact_when_a_step_jitters_by_one_percent() -> None:
    # A step within 2 % of a whole number of periods takes the ready coefficients: the copy is then wrong
    # by 1 % of one period's change, 1e-5 s x 1 rad/s; anything above 1e-4 rad would be another step.
    observer, exact = SuperTwisting(setting(), M=0.0), MatrixObserver(f0=0.1, M=0.0, mu0=40.0)
    observer.update(Sample(0.0, 0.0, 0.0))
    exact.start(0.0)
    t = 0.0
    for k in range(1, 100):
        before, t = t, k * T + (0.01 * T if k % 2 else -0.009 * T) / 2
        got = observer.update(Sample(t, t, 0.0))
        expected = exact.step(t - before, t, 0.0)
        assert got.position == pytest.approx(expected[0], abs=1e-4)
        assert got.velocity == pytest.approx(expected[1], abs=2e-3)


def test_super_twisting_starts_at_rest_where_the_arm_is() -> None:
    observer = SuperTwisting(setting())
    assert observer.update(Sample(12.0, -1.57, 3.0)) == Estimate(-1.57, 0.0, 0.0)


def test_super_twisting_stays_exactly_at_rest_when_nothing_moves() -> None:
    # b = 0 in every period but for rounding; without the cap a tiny b ends in cos(inf).
    observer = SuperTwisting(setting(), mu0=0.0)
    for k in range(2000):
        assert observer.update(Sample(k * T, 0.0, 0.0)) == Estimate(0.0, 0.0, 0.0)


@pytest.mark.parametrize("mu0", [0.0, 40.0])
@pytest.mark.parametrize("M", [0.0, 15.0, 1000.0])
@pytest.mark.parametrize("y", [0.0, 1e-31, -1e-31, 5e-324, 1e-30, 1e-25, -1e-17])
def test_super_twisting_does_not_raise_when_the_innovation_is_tiny(y: float, M: float, mu0: float) -> None:
    observer = SuperTwisting(setting(), M=M, mu0=mu0)
    observer.update(Sample(0.0, 0.0, 0.0))
    for k in range(1, 5):
        got = observer.update(Sample(k * T, y, 0.0))
        assert all(math.isfinite(value) for value in got)
        assert abs(got.disturbance) < 1e-9  # rad/s2: b / T^2 of 1e-17 rad is 1e-11


def test_super_twisting_does_not_correct_when_neither_floor_nor_slope_is_given() -> None:
    observer = SuperTwisting(setting(), M=0.0, mu0=0.0)
    observer.update(Sample(0.0, 0.0, 0.0))
    got = observer.update(Sample(T, 1.0, 0.0))
    h1 = (2.44692e-3, 2.75041e-3)  # theory.md, section 4: only the copy answers
    assert tuple(got) == pytest.approx((*h1, 0.0), rel=1e-5, abs=0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["position", "voltage"])
def test_super_twisting_never_looks_healthy_when_a_number_is_not_finite(field: str, bad: float) -> None:
    observer = SuperTwisting(setting())
    for k in range(5):
        observer.update(Sample(k * T, 0.1, 1.0))
    got = observer.update(spoilt(Sample(5 * T, 0.1, 1.0), field, bad))
    assert not any(math.isfinite(value) for value in got)
    again = observer.update(Sample(6 * T, 0.1, 1.0))
    assert all(math.isnan(value) for value in again)
    if field == "position":
        assert all(math.isnan(value) for value in got)


@pytest.mark.parametrize("t", [5 * T, 4 * T, -1.0, 5 * T - 1e-9])
def test_super_twisting_refuses_time_that_stands_still_or_runs_back(t: float) -> None:
    observer = SuperTwisting(setting())
    for k in range(6):
        observer.update(Sample(k * T, 0.1, 0.0))
    with pytest.raises(ProtocolError, match="does not come after"):
        observer.update(Sample(t, 0.1, 0.0))


@pytest.mark.parametrize(("periods", "restarts"), [(10.0, False), (10.5, True), (11.0, True), (5000.0, True)])
def test_super_twisting_restarts_when_the_gap_is_longer_than_ten_periods(
    periods: float, restarts: bool
) -> None:
    observer = SuperTwisting(setting())
    for k in range(100):
        observer.update(Sample(k * T, 0.5 * k * T, 0.0))
    got = observer.update(Sample((99 + periods) * T, 0.7, 0.0))
    assert (got == Estimate(0.7, 0.0, 0.0)) == restarts


@pytest.mark.parametrize(
    ("counts", "period", "expected"),
    [  # 40 (counts/4096)^(1/3) (1e-3/T)^(1/6) rad/s, mu0 T <= 0.3: theory.md, section 4, tuning rule
        (4096.0, 1e-3, 40.0),
        (512.0, 1e-3, 20.0),
        (32768.0, 1e-3, 80.0),
        (4096.0, 1e-3 / 64.0, 80.0),
        (4096.0, 64e-3, 0.3 / 64e-3),  # the rule would say 20
        (2.0**24, 1e-3, 300.0),  # the rule would say 640
        (None, 1e-3, 300.0),
    ],
)
def test_bandwidth_floor_follows_the_rule_and_its_cap(
    counts: float | None, period: float, expected: float
) -> None:
    assert bandwidth_floor(counts, period) == pytest.approx(expected, rel=1e-12, abs=0)
    assert SuperTwisting(setting(period=period, counts=counts)).mu0 == pytest.approx(
        expected, rel=1e-12, abs=0
    )


def test_slope_bound_is_the_papers_only_when_the_encoder_is_ideal() -> None:
    assert slope_bound(None) == 1000.0
    assert slope_bound(4096.0) == slope_bound(65536.0) == 15.0


class _Set(SuperTwisting):
    """The observer put into a state from outside."""

    def outputs(self, z: tuple[float, float], v: tuple[float, float, float], y: float) -> Estimate:
        self.update(Sample(0.0, y, 0.0))
        (self._z1, self._z2), (self._v1, self._v2, self._v3) = z, v
        return self.update(Sample(1e-15, y, 0.0))  # no time to change anything


@given(st.floats(0.0, 60.0))
def test_super_twisting_outputs_are_exact_when_its_states_are(t: float) -> None:
    # w = 3 + sin 1.7 t: e'' + (L1 + f0) e' + (L2 + f0 L1) e = w has the steady solution below, and a plant
    # at x = x2 = 0.4, -0.3 then has its copy at z = x - e, x2 - e' - L1 e (eqs. 2, 6, 7).
    f0, rate = 0.1, 1.7
    transfer = 1.0 / complex(L2 + f0 * L1 - rate * rate, (L1 + f0) * rate)
    swing = transfer * complex(math.cos(rate * t), math.sin(rate * t))
    e = 3.0 / (L2 + f0 * L1) + swing.imag
    e1, e2 = rate * swing.real, -rate * rate * swing.imag
    x1, x2, w = 0.4, -0.3, 3.0 + math.sin(rate * t)
    observer = _Set(setting(f0=f0), M=0.0, mu0=0.0)
    got = observer.outputs((x1 - e, x2 - e1 - L1 * e), (e, e1, e2), x1)
    assert tuple(got) == pytest.approx((x1, x2, w), abs=1e-9)  # theory.md, section 5, first row
