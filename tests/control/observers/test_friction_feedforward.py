"""Friction told to the observer as a known input: what goes in, what comes out."""

from __future__ import annotations

import pytest

from dcmp_hil.control.observers.friction_feedforward import KnownFriction
from dcmp_hil.values import Estimate, Reference, Sample
from tests.helpers import T, setting


class _Told:
    """An observer that finds the same rest every time and remembers what it was told."""

    def __init__(self) -> None:
        self.voltages: list[float] = []

    def update(self, sample: Sample) -> Estimate:
        self.voltages.append(sample.voltage)
        return Estimate(sample.position, 0.0, 7.0)


def _velocity_is(velocity: float) -> Reference:
    return Reference(0.0, velocity, 0.0)


@pytest.mark.parametrize(
    ("velocity", "friction"),
    [(0.5, -1.3), (-0.5, 1.3), (0.0, 0.0), (0.005, -1.3), (0.0025, -0.65), (-0.00125, 0.325)],
)
def test_known_friction_reports_the_whole_disturbance(velocity: float, friction: float) -> None:
    # friction in rad/s2: -f1 sat(x_r' / 0.005 rad/s) with f1 = 1.3
    told = _Told()
    observer = KnownFriction(told, setting(), lambda _: _velocity_is(velocity), T)
    observer.update(Sample(0.0, 0.0, 0.0))
    got = observer.update(Sample(T, 0.0, 2.0))
    assert got.disturbance == pytest.approx(7.0 + friction, rel=1e-12, abs=0)
    assert told.voltages[-1] == pytest.approx(2.0 + friction / 5.4, rel=1e-12, abs=0)  # the same as a voltage


def test_known_friction_looks_at_the_middle_of_the_gap_and_at_the_command() -> None:
    # The reference turns at t = 10 ms: samples at 8 and 11 ms have their middle before it, at 9.5 ms,
    # and the command that follows acts at 12 ms, after it.
    told = _Told()
    observer = KnownFriction(told, setting(), lambda t: _velocity_is(1.0 if t < 0.010 else -1.0), T)
    observer.update(Sample(0.008, 0.0, 0.0))
    got = observer.update(Sample(0.011, 0.0, 0.0))
    assert told.voltages[-1] == pytest.approx(-1.3 / 5.4, rel=1e-12, abs=0)
    assert got.disturbance == pytest.approx(7.0 + 1.3, rel=1e-12, abs=0)
