"""R0: the paper's observer by explicit Euler, one step by hand; its figures are in tests/paper."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.control.observers.paper import PaperObserver
from dcmp_hil.errors import ProtocolError
from dcmp_hil.values import Estimate, Sample
from tests.helpers import T, setting, spoilt


def test_paper_observer_takes_the_euler_step_computed_by_hand() -> None:
    # z = v = 0, y = 0.125 rad, V = 2 V, M = 1000 (M^(1/3) = 10): |e|^(2/3) = 1/4, so
    # n1 = 2 x 10 / 4 = 5, n2 = 1.5 sqrt(1000) sqrt(5) = 75 sqrt 2, n3 = +1.1 x 1000.
    observer = PaperObserver(setting(), from_zero=True)
    assert observer.update(Sample(0.0, 0.125, 0.0)) == Estimate(0.0, 0.0, 0.0)
    got = observer.update(Sample(T, 9.0, 2.0))  # the new position is only stored
    v1, v2, v3 = 5.0 * T, 75.0 * 2**1.5 / 2.0 * T, 1100.0 * T
    z1 = T * 4.9 * 0.125
    z2 = T * (5.4 * 2.0 + 5.51 * 0.125)
    assert got.position == pytest.approx(z1 + v1, rel=1e-12, abs=0)
    assert got.velocity == pytest.approx(z2 + v2 + 4.9 * v1, rel=1e-12, abs=0)
    assert got.disturbance == pytest.approx(
        v3 + 5.0 * v2 + 6.0 * v1, rel=1e-12, abs=0
    )  # section 2, paper's gains


def test_paper_observer_uses_the_stored_position_in_the_next_step() -> None:
    observer = PaperObserver(setting())
    observer.update(Sample(0.0, 1.0, 0.0))
    assert observer.update(Sample(T, 2.0, 0.0)) == Estimate(1.0, 0.0, 0.0)
    assert observer.update(Sample(2 * T, 2.0, 0.0)).position > 1.0


def test_paper_observer_stays_exactly_at_rest_when_the_error_is_zero() -> None:
    observer = PaperObserver(setting())
    for k in range(50):  # sgn(0) = 0, or v3 would creep by 1.1 M T a period
        assert observer.update(Sample(k * T, 0.3, 0.0)) == Estimate(0.3, 0.0, 0.0)


@pytest.mark.parametrize(("from_zero", "expected"), [(True, 0.0), (False, -1.57)])
def test_paper_observer_starts_where_it_is_told(from_zero: bool, expected: float) -> None:
    observer = PaperObserver(setting(), from_zero=from_zero)
    assert observer.update(Sample(0.0, -1.57, 0.0)) == Estimate(expected, 0.0, 0.0)


@pytest.mark.parametrize("from_zero", [True, False])
def test_paper_observer_restarts_at_the_position_when_the_gap_is_too_long(from_zero: bool) -> None:
    observer = PaperObserver(setting(), from_zero=from_zero)
    for k in range(20):
        observer.update(Sample(k * T, 0.1 * k, 1.0))
    assert observer.update(Sample(30 * T, 0.7, 0.0)) == Estimate(0.7, 0.0, 0.0)


def test_paper_observer_takes_the_true_step_when_samples_are_lost() -> None:
    observer = PaperObserver(setting(), from_zero=True)
    observer.update(Sample(0.0, 0.125, 0.0))
    got = observer.update(Sample(3 * T, 0.0, 0.0))
    assert got.position == pytest.approx(
        3 * T * (4.9 * 0.125 + 5.0), rel=1e-12, abs=0
    )  # as by hand, three times


@pytest.mark.parametrize("t", [0.0, -T])
def test_paper_observer_refuses_time_that_stands_still_or_runs_back(t: float) -> None:
    observer = PaperObserver(setting())
    observer.update(Sample(0.0, 0.1, 0.0))
    with pytest.raises(ProtocolError):
        observer.update(Sample(t, 0.1, 0.0))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["position", "voltage"])
def test_paper_observer_never_looks_healthy_when_a_number_is_not_finite(field: str, bad: float) -> None:
    observer = PaperObserver(setting())
    observer.update(Sample(0.0, 0.1, 0.0))
    observer.update(spoilt(Sample(T, 0.1, 0.0), field, bad))
    observer.update(Sample(2 * T, 0.1, 0.0))
    got = observer.update(Sample(3 * T, 0.1, 0.0))  # a position acts one step later
    assert not all(math.isfinite(value) for value in got)


class _Set(PaperObserver):
    def outputs(self, z: tuple[float, float], v: tuple[float, float, float], y: float) -> Estimate:
        self.update(Sample(0.0, y, 0.0))
        (self._z1, self._z2), (self.v1, self.v2, self.v3) = z, v
        return self.update(Sample(1e-15, y, 0.0))


@pytest.mark.parametrize("t", [0.0, 0.4, 1.1, 2.9, 17.3])
@pytest.mark.parametrize(("L1", "L2"), [(4.9, 5.51), (3.0, 20.0)])
def test_paper_observer_outputs_are_exact_when_its_states_are(t: float, L1: float, L2: float) -> None:
    # As in test_super_twisting: w = 2 cos 0.9 t, x = (0.1, 0.7), e the steady answer of the copy.
    f0, rate = 0.1, 0.9
    swing = 2.0 / complex(L2 + f0 * L1 - rate * rate, (L1 + f0) * rate)
    swing *= complex(math.cos(rate * t), math.sin(rate * t))
    e, e1, e2 = swing.real, -rate * swing.imag, -rate * rate * swing.real
    observer = _Set(setting(f0=f0), L1=L1, L2=L2)
    got = observer.outputs((0.1 - e, 0.7 - e1 - L1 * e), (e, e1, e2), 0.1)
    assert tuple(got) == pytest.approx((0.1, 0.7, 2.0 * math.cos(rate * t)), abs=1e-9)
    assert observer.disturbance() == got.disturbance
