"""Several faults at once, drawn at random: the oracle finds no violation."""

from __future__ import annotations

import os
import random

import pytest

from dcmp_hil import errors
from dcmp_hil.session import Session
from dcmp_hil.values import Fault as Code
from sim_backend.board.board import Board
from sim_backend.faults.fault_model import Choice
from sim_backend.faults.fault_spec import KINDS, FaultSpec
from sim_backend.faults.plan import FaultPlan
from tests.faults.matrix import outcome_of, same_session
from tests.faults.oracle import Oracle
from tests.helpers import bench

SEED_COUNT = 20 * int(os.environ.get("DCMP_FAULT_SEEDS", "2"))
DURATION_S = 1.0  # s
_FROM_BOOT = 0.15
ON_PURPOSE = {"completed", "InjectedError", "InjectedBaseError", *(code.name for code in Code)}
REASONS = {
    *("speed", "travel", "disturbance", "stuck", "power", "polarity", "not_finite", "gain", "moving"),
    *("saturation", "tracking", "jump", "chatter"),
}
pytestmark = pytest.mark.untraced


def drawn(rng: random.Random) -> FaultSpec:
    """Draw a fault with parameters anywhere in their bounds, small ones as often as large ones."""
    name = rng.choice([kind for kind in KINDS if kind != "firmware.start"])
    params: dict[str, float | str] = {}
    for key, param in KINDS[name].params.items():
        if isinstance(param, Choice):
            params[key] = rng.choice(param.words)
        else:
            params[key] = min(param.high, max(param.low, param.default * 10 ** rng.uniform(-1.5, 1.5)))
    at = "boot" if rng.random() < _FROM_BOOT else rng.uniform(0.0, 0.8)
    return FaultSpec(name, at, rng.uniform(0.001, 0.4), **params)


def mixed(seed: int) -> tuple[str, list[str], list[str]]:
    """Run a mixture; return how it ended, what the oracle says, and what went wrong on purpose."""
    rng = random.Random(f"mixture {seed}")
    faults = [drawn(rng) for _ in range(rng.randrange(1, 5))]
    rig = bench("backend.kind=sim-board", "supervisor.start=immediate")
    oracle = Oracle()
    injector = FaultPlan(faults, seed).on(rig, oracle, Board(rig))
    with same_session(seed):
        outcome = outcome_of(Session(rig, duration=DURATION_S, fast=True, faults=injector))
    return (
        outcome,
        oracle.violations,
        [f"{fault.kind} {fault.at} {fault.for_} {fault.params}" for fault in faults],
    )


def is_known(outcome: str) -> bool:
    """Return whether a run may end with this outcome."""
    kind = getattr(errors, outcome, None)
    return outcome in ON_PURPOSE | REASONS or (kind is not None and issubclass(kind, errors.DcmpError))


@pytest.mark.parametrize("first", range(0, SEED_COUNT, 10))
def test_no_mixture_of_faults_breaks_a_rule(first: int) -> None:
    for seed in range(first, first + 10):
        outcome, violations, faults = mixed(seed)
        assert is_known(outcome), (seed, outcome, faults)
        assert violations == [], (seed, faults)
