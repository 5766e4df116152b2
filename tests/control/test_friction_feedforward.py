"""Friction told to the observer as a known input: what goes in, what comes out."""

from __future__ import annotations

import pytest

from dcmp_hil.control.friction_feedforward import FrictionFeedforward
from dcmp_hil.control.model import Model
from dcmp_hil.values import Estimate, Sample
from tests.helpers import T

_REST = Estimate(0.0, 0.0, 7.0)


@pytest.mark.parametrize(
    ("velocity", "friction"),
    [(0.5, -1.3), (-0.5, 1.3), (0.0, 0.0), (0.005, -1.3), (0.0025, -0.65), (-0.00125, 0.325)],
)
def test_observer_is_told_of_friction_and_the_whole_disturbance_comes_back(
    velocity: float, friction: float
) -> None:
    # friction in rad/s2: -f1 sat(x_r' / 0.005 rad/s) with f1 = 1.3
    feedforward = FrictionFeedforward(Model())
    told = feedforward.told(Sample(T, 0.1, 2.0, 3), velocity)
    assert told._replace(voltage=2.0) == Sample(T, 0.1, 2.0, 3)
    assert told.voltage == pytest.approx(2.0 + friction / 5.4, rel=1e-12, abs=0)  # the same as a voltage
    whole = feedforward.whole(_REST, velocity)
    assert whole._replace(disturbance=7.0) == _REST
    assert whole.disturbance == pytest.approx(7.0 + friction, rel=1e-12, abs=0)


def test_nothing_acted_before_the_first_sample_or_while_time_stood_still() -> None:
    feedforward = FrictionFeedforward(Model())
    for t, volts in ((0.0, 0.0), (T, -1.3 / 5.4), (T, 0.0)):
        assert feedforward.told(Sample(t, 0.0, 0.0), 1.0).voltage == pytest.approx(volts, rel=1e-12, abs=0)
    assert feedforward.middle(3 * T) == 2 * T
