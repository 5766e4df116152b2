"""100,000 steps of everything that may happen, in virtual time; the judge sees every tick of them."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test

from tests.stateful.machine import Machine

STEPS = int(os.environ.get("DCMP_STATEFUL_STEPS", "100000"))
PART_COUNT = 8  # of them, each with a seed of its own
RULES_PER_RUN = 250  # rules in an example at most; the mean is nearly that
_MEAN_STEPS_MIN = 195  # steps of an example at least, over many: Hypothesis draws by what else is imported


def budget(examples: int, length: int) -> settings:
    """Return settings under which every run is the same."""
    return settings(
        max_examples=examples, stateful_step_count=length, derandomize=True, deadline=None, database=None,
        phases=[Phase.generate], suppress_health_check=list(HealthCheck), report_multiple_bugs=False,
    )  # fmt: skip


@pytest.mark.sampled
@pytest.mark.untraced
@pytest.mark.parametrize("part", range(PART_COUNT))
def test_no_sequence_of_events_breaks_a_rule(part: int) -> None:
    steps = STEPS // PART_COUNT
    Machine.steps = 0
    machine = seed(part)(type("Part", (Machine,), {}))
    run_state_machine_as_test(machine, settings=budget(1 + steps // _MEAN_STEPS_MIN, RULES_PER_RUN))
    assert Machine.steps >= steps, f"{Machine.steps} steps are fewer than {steps}"
