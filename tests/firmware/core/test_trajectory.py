"""The trajectory in C: the bits of `dcmp_hil.control.trajectory`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.control.trajectory import Trajectory
from dcmp_hil.values import Reference
from tests.firmware.law import Array, Law, same_bits

if TYPE_CHECKING:
    from tests.firmware.bench import Core

HELD, FROM = 0.3, -0.2  # rad


class _Asked:
    """A reference that notes what it answered."""

    def __init__(self) -> None:
        self.answer = Reference(0.0, 0.0, 0.0)

    def at(self, t: float) -> Reference:
        self.answer = Reference(math.sin(3.0 * t) + 0.1, 3.0 * math.cos(3.0 * t), -9.0 * math.sin(3.0 * t))
        return self.answer


def _case(
    period: float, soft_start: float, delay: float, begins: int, ticks: list[int]
) -> tuple[Array, Array]:
    """Return what C is given, and what Python makes of it."""
    source = _Asked()
    python = Trajectory(source, soft_start)
    python.hold(HELD)
    rows, wanted, before = list[list[float]](), list[float](), 0
    for tick in ticks:
        t = tick * period
        if tick >= begins and python.began == math.inf:
            python.begin(t, FROM)
        row: list[float] = [tick]
        for instant in (t + delay, t + 0.0, 0.5 * (t + before * period)):
            wanted.extend(python.at(instant))
            row.extend(source.answer)
        rows.append(row)
        before = tick
    return np.array(rows, float), np.array(wanted).reshape(len(rows), 9)


@pytest.mark.parametrize("period", [1e-3, 1e-4, 1.0 / 3000.0])
@pytest.mark.parametrize("soft_start", [0.0, 0.1, 0.25])
@pytest.mark.parametrize("late", [0, 1])
@pytest.mark.parametrize("begins", [0, 7, 331])
def test_trajectory_has_the_bits_of_python(
    core: Core, period: float, soft_start: float, late: int, begins: int
) -> None:
    ticks = sorted({*range(900), *range(900, 4000, 17)} - set(range(400, 440, 3)))
    rows, wanted = _case(period, soft_start, late * period, begins, ticks)
    setup = np.array([period, soft_start, late * period, begins, HELD, FROM])
    assert same_bits(Law(core)("trajectory", setup, rows, width=9), wanted)
    if soft_start:
        single = Law(core, "float_")("trajectory", setup, rows, width=9)
        assert np.abs(single - wanted).max() < 2e-3


def test_end_of_the_soft_start_is_the_instant_that_python_rounds(core: Core) -> None:
    """The sum of the beginning and the length, and the difference of two instants, may round apart."""
    period, length, apart = 1e-3, 0.1, set()
    for begins in range(3000):
        t0, tick = begins * period, begins + 99
        t = tick * period + period
        if (t < t0 + length) == (t - t0 < length):
            continue
        apart.add(t < t0 + length)
        rows, wanted = _case(period, length, period, begins, [begins, tick])
        setup = np.array([period, length, period, begins, HELD, FROM])
        assert same_bits(Law(core)("trajectory", setup, rows, width=9), wanted)
    assert apart == {True, False}


@pytest.mark.parametrize("kind", ["", "float_"])
def test_soft_start_is_over_at_its_end(core: Core, kind: str) -> None:
    period, small = 2.0**-10, 2.0**-30
    setup = np.array([period, 0.25, 0.0, 0.0, HELD, FROM])
    rows = np.array([[0.0, *[0.0] * 9], [256.0, *[small, 0.0, 0.0] * 3]])
    assert Law(core, kind)("trajectory", setup, rows, width=9)[1, 0] == small
