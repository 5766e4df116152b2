"""The null plan: healthy rigs, as different as healthy rigs are; nothing may trip."""

from __future__ import annotations

import random

from dcmp_hil import load_rig
from dcmp_hil.session import Session
from sim_backend.board.board import Board
from sim_backend.faults.plan import FaultPlan
from tests.faults.matrix import Verdict, outcome_of
from tests.faults.oracle import Oracle

DURATION_S = 2.5  # s
_BELIEVED_KU = 5.4
_REFERENCES = (
    ("reference.kind=step", "reference.after_rad=1.0", "reference.at_s=0.8", "reference.soft_start_s=0.1"),
    ("reference.kind=step", "reference.after_rad=-1.0", "reference.at_s=0.8", "reference.soft_start_s=0.1"),
    ("reference.soft_start_s=0.5",),
    ("reference.soft_start_s=0.5", "reference.rate_rad_s=2.0"),
)


def healthy(seed: int) -> Verdict:
    """Run a healthy rig: encoder phase and noise, motor gain and reference follow from the seed."""
    rng = random.Random(f"healthy {seed}")
    rig = load_rig(
        "bench-1khz",
        (
            "backend.kind=sim-board",
            "encoder.zero=0",
            f"sim.seed={seed}",
            f"sim.encoder_phase_counts={rng.random():.4f}",
            f"sim.encoder_noise_counts={rng.uniform(0.0, 0.5):.4f}",
            f"sim.plant.ku_rad_s2_V={_BELIEVED_KU * rng.uniform(0.6, 1.5):.4f}",
            *rng.choice(_REFERENCES),
        ),
    )
    oracle = Oracle()
    injector = FaultPlan(seed=seed).on(rig, oracle, Board(rig, carrier="cobs"))
    outcome = outcome_of(Session(rig, duration=DURATION_S, fast=True, faults=injector))
    return Verdict(outcome, outcome == "completed", float("nan"), tuple(oracle.violations))
