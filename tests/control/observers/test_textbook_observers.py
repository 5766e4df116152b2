"""The observers that people would otherwise use: each against its textbook's own statement."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are
from scipy.signal import lfilter

from dcmp_hil import load_rig
from dcmp_hil.control.observers.derivative import Derivative
from dcmp_hil.control.observers.extended_state import ExtendedState
from dcmp_hil.control.observers.kalman import Kalman
from dcmp_hil.control.observers.settings import OneGainSettings
from dcmp_hil.errors import ConfigError, ProtocolError
from dcmp_hil.values import Estimate, Sample
from tests.helpers import T, setting

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.control.observers import Observer

_KU = 5.4  # (rad/s2)/V
_MAKERS: dict[str, Callable[[], Observer]] = {
    "derivative": lambda: Derivative(setting()),
    "extended_state": lambda: ExtendedState(setting()),
    "kalman": lambda: Kalman(setting()),
}
EVERY = pytest.mark.parametrize("kind", _MAKERS)


def _ride(observer: Observer, w: float, volts: float, n: int = 3000) -> tuple[Estimate, float, float]:
    """Let a plant with constant w and voltage go from rest; return the estimate, and the true x1 and x2."""
    f0, x1, x2 = 0.1, 0.4, 0.0
    step = expm(T * np.array([[0.0, 1.0, 0.0], [0.0, -f0, 1.0], [0.0, 0.0, 0.0]]))
    got, true = Estimate(math.nan, math.nan, math.nan), (math.nan, math.nan)
    for k in range(n):
        got = observer.update(Sample(k * T, x1, volts))
        true = (x1, x2)
        x1, x2, _ = step @ [x1, x2, w + _KU * volts]
    return got, *true


@EVERY
def test_a_constant_disturbance_is_found_under_a_constant_voltage(kind: str) -> None:
    got, x1, x2 = _ride(_MAKERS[kind](), w=-2.0, volts=0.5)
    lag = (1e-3 + 1.0 / 60.0) * 0.7  # s of the filter, at 0.7 rad/s2; the others have none
    assert got.position == pytest.approx(x1, abs=1e-6)
    assert got.velocity == pytest.approx(x2, abs=lag if kind == "derivative" else 1e-4)
    assert got.disturbance == pytest.approx(-2.0, abs=0.01)


@EVERY
def test_the_first_sample_and_one_after_a_long_gap_begin_at_rest(kind: str) -> None:
    observer = _MAKERS[kind]()
    assert observer.update(Sample(0.0, -1.57, 3.0)) == Estimate(-1.57, 0.0, 0.0)
    for k in range(1, 20):
        observer.update(Sample(k * T, -1.57 + 0.01 * k, 1.0))
    assert observer.update(Sample(30 * T, 0.7, 0.0)) == Estimate(0.7, 0.0, 0.0)


@EVERY
def test_a_sample_that_does_not_come_later_is_refused(kind: str) -> None:
    observer = _MAKERS[kind]()
    observer.update(Sample(1.0, 0.0, 0.0))
    with pytest.raises(ProtocolError, match="does not come after"):
        observer.update(Sample(1.0, 0.0, 0.0))


@EVERY
def test_a_lost_sample_is_a_longer_step(kind: str) -> None:
    every, half = _MAKERS[kind](), _MAKERS[kind]()
    ramp = [Sample(k * T, 0.2 * k * T, 0.02 / _KU) for k in range(2001)]
    got = [every.update(sample) for sample in ramp][-1]
    seen = [half.update(sample) for sample in ramp[::2]][-1]
    assert seen.velocity == pytest.approx(got.velocity, abs=1e-6)
    assert seen.disturbance == pytest.approx(got.disturbance, abs=1e-4)


@EVERY
def test_the_rig_makes_it_and_its_key_changes_in_a_run(kind: str) -> None:
    rig = load_rig("bench-1khz", [f"observer.kind={kind}"])
    assert rig.observer.kind == kind
    assert rig.observer.tunable() == (("w_noise",) if kind == "kalman" else ("bandwidth_rad_s",))  # type: ignore[union-attr]


@pytest.mark.parametrize("bandwidth", [20.0, 100.0])
def test_derivative_is_the_filter_of_its_equation(bandwidth: float) -> None:
    rng = np.random.default_rng(1)
    y, u = np.cumsum(rng.normal(0.0, 1e-3, 400)), rng.normal(0.0, 1.0, 400)
    y[0] = 0.0
    share = 1.0 - math.exp(-bandwidth * T)
    low_pass = [share], [1.0, share - 1.0]  # G(z)
    v = lfilter(*low_pass, np.diff(y, prepend=0.0) / T)
    held = lfilter(*low_pass, np.where(np.arange(400) > 0, u, 0.0))
    w = lfilter(*low_pass, np.diff(v, prepend=0.0) / T + 0.1 * v - held)
    observer = Derivative(setting(), bandwidth=bandwidth)
    got = [observer.update(Sample(k * T, y[k], u[k] / _KU)) for k in range(400)]
    np.testing.assert_allclose([one.velocity for one in got], v, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose([one.disturbance for one in got], w, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("bandwidth", [10.0, 60.0, 300.0])
def test_extended_state_has_all_poles_of_its_error_at_its_bandwidth(bandwidth: float) -> None:
    # What is left of a glitch obeys (z - b)^3 x = 0.
    observer = ExtendedState(setting(f0=0.0), bandwidth=bandwidth)
    observer.update(Sample(0.0, 0.0, 0.0))
    left = np.array([observer.update(Sample(k * T, 1.0 * (k == 1), 0.0)) for k in range(1, 40)])
    b = math.exp(-bandwidth * T)
    rest = left[3:] - 3 * b * left[2:-1] + 3 * b * b * left[1:-2] - b**3 * left[:-3]
    assert np.abs(rest / np.abs(left).max(axis=0)).max() < 1e-9


def test_kalman_gain_settles_at_the_solution_of_the_riccati_equation() -> None:
    observer = Kalman(setting(f0=0.1), w_noise=50.0)
    for k in range(4000):
        observer.update(Sample(k * T, 0.0, 0.0))
    f = np.array([[1.0, T - 0.05 * T * T, 0.5 * T * T], [0.0, 1.0 - 0.1 * T, T], [0.0, 0.0, 1.0]])
    powers = [[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]]
    count = 2.0 * math.pi / 4096
    h, r = np.array([[1.0, 0.0, 0.0]]), count * count / 12.0
    before = solve_discrete_are(f.T, h.T, 50.0 * np.array(powers), [[r]])
    gain = (before @ h.T)[:, 0] / (before[0, 0] + r)
    np.testing.assert_allclose(observer.update(Sample(4.0, 1.0, 0.0)), gain, rtol=1e-6)


def test_a_change_of_the_gain_leaves_the_estimate_where_it_is() -> None:
    derivative, extended, kalman = Derivative(setting()), ExtendedState(setting()), Kalman(setting())
    pairs: tuple[tuple[Observer, Callable[[], None]], ...] = (
        (derivative, lambda: derivative.retune(200.0)),
        (extended, lambda: extended.retune(120.0)),
        (kalman, lambda: kalman.retune(500.0)),
    )
    for observer, change in pairs:
        ramp = (Sample(k * T, 0.2 * k * T, 0.02 / _KU) for k in range(1500))
        old = [observer.update(next(ramp)) for _ in range(1000)][-1]
        change()
        for new in (observer.update(sample) for sample in ramp):
            assert new.velocity == pytest.approx(old.velocity, abs=1e-6)
            assert new.disturbance == pytest.approx(old.disturbance, abs=1e-3)


def test_kalman_is_refused_with_an_ideal_encoder() -> None:
    with pytest.raises(ConfigError, match="this encoder is ideal"):
        load_rig("bench-1khz", ["observer.kind=kalman", "encoder.counts_per_rev=ideal"])


@pytest.mark.parametrize(
    "key", ["derivative.bandwidth_rad_s", "extended_state.bandwidth_rad_s", "kalman.w_noise"]
)
def test_the_one_gain_of_the_settings_is_what_the_observer_is_retuned_with(key: str) -> None:
    kind, _, gain = key.partition(".")
    section = load_rig("bench-1khz", [f"observer.kind={kind}", f"observer.{gain}=77"]).observer
    assert isinstance(section, OneGainSettings)
    assert (section.tunable(), section.tuning(setting())) == ((gain,), 77.0)
