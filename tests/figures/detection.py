"""Runs into a fault, and how soon it is found: for the tests of the detector, and for `tools.encoders`.

The bounds count while |x_r'| > 0.1 rad/s, from the fault or from the moment it exceeds it: with the arm and
its reference at rest these faults change nothing that could be seen.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.errors import TripError
from dcmp_hil.session import Session
from tests.helpers import T, bench

if TYPE_CHECKING:
    from tests.helpers import FaultySim

ENGAGED_AT_S = 0.25  # s, when the trajectory starts


class Detection(NamedTuple):
    fault_at: float  # s
    tripped_at: float  # s, NaN if it never did
    judged_from: float  # s
    reason: str
    speed: float  # rad/s, the plant's own, from the fault on
    distance: float  # rad, the plant's own, from hanging, all the run

    @property
    def time(self) -> float:
        return max(0.0, self.tripped_at - self.judged_from)


def first_motion(t: float) -> float:
    """Return when |x_r'| = |cos((t - 0.25)/2)|/2 first exceeds 0.1 rad/s, from `t` on, s."""
    while abs(0.5 * math.cos(0.5 * (t - ENGAGED_AT_S))) <= 0.1:
        t += T
    return t


def detect(backend: type[FaultySim], *overrides: str, seeds: int = 20) -> list[Detection]:
    """Run into the fault at as many instants and encoder phases as there are seeds."""
    found = []
    for seed in range(seeds):
        rig = bench(
            f"backend.kind=tests.helpers:{backend.__name__}",
            f"sim.seed={seed}",
            f"sim.encoder_phase_counts={seed / seeds}",
            "supervisor.probe=off",
            *overrides,
        )
        at = backend.instant(rig)
        session = Session(rig, duration=at + 4.0, fast=True)
        reason, tripped = "", math.nan
        try:
            session.run()
        except TripError as trip:
            reason, tripped = trip.reason, trip.cycles[-1].sample.t
        columns = session.result().columns
        speed = np.abs(columns["velocity_true_rad_s"][columns["time_s"] >= at]).max(initial=0.0)
        distance = np.abs(columns["position_true_rad"]).max()
        found.append(Detection(at, tripped, first_motion(at), reason, float(speed), float(distance)))
    return found
