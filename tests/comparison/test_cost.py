"""The cost of a step: the best of several rounds, by a clock that the test moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.comparison import cost_per_step
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.values import Estimate, Sample
from tests.helpers import T, setting

if TYPE_CHECKING:
    from dcmp_hil.control.observers import Observer

SAMPLES = [Sample(k * T, 0.0, 0.0) for k in range(100)]


class Moved:
    """A clock that goes on only when an observer lets it."""

    def __init__(self) -> None:
        self.ns = 0

    def now_ns(self) -> int:
        return self.ns

    def sleep_until_ns(self, deadline_ns: int) -> None:
        self.ns = deadline_ns


class Slow:
    """An observer whose steps take so many ns; twice as long in its first round."""

    made = 0

    def __init__(self, clock: Moved, step_ns: int) -> None:
        Slow.made += 1
        self._clock, self._step_ns = clock, step_ns * (2 if Slow.made <= 2 else 1)

    def update(self, sample: Sample) -> Estimate:
        self._clock.ns += self._step_ns
        return Estimate(sample.position, 0.0, 0.0)


class Raises:
    """An observer that fails in the middle."""

    def update(self, sample: Sample) -> Estimate:
        if sample.t > 50 * T:
            raise ZeroDivisionError
        return Estimate(0.0, 0.0, 0.0)


def test_the_cost_is_that_of_the_best_round() -> None:
    clock = Moved()
    Slow.made = 0
    found = cost_per_step(
        {"one": lambda: Slow(clock, 1500), "other": lambda: Slow(clock, 4000), "broken": Raises},
        SAMPLES,
        clock,
    )
    assert found == {"one": pytest.approx(1.5), "other": pytest.approx(4.0), "broken": None}
    assert Slow.made > 6


def test_an_observer_that_takes_50_ms_for_a_step_is_asked_a_hundred_times_at_most() -> None:
    clock = Moved()
    Slow.made = 2
    samples = [Sample(k * T, 0.0, 0.0) for k in range(250)]
    assert cost_per_step({"one": lambda: Slow(clock, 50_000_000)}, samples, clock) == {"one": 50_000.0}
    assert (Slow.made, clock.ns) == (3, 100 * 50_000_000)


def test_without_samples_there_is_no_cost() -> None:
    assert cost_per_step({"one": Raises}, []) == {"one": None}


def test_a_real_observer_costs_something_and_is_fresh_in_every_round() -> None:
    made: list[Observer] = []

    def make() -> Observer:
        made.append(SuperTwisting(setting()))
        return made[-1]

    cost = cost_per_step({"super_twisting": make}, SAMPLES)["super_twisting"]
    assert cost is not None
    assert 0.0 < cost < 1e5
    assert len({id(one) for one in made}) == len(made) > 1
