"""Rigs whose whole cycle is tried on the chip, and what a run in C is told of them."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from dcmp_hil.assembly import assemble
from dcmp_hil.platform.clock import SimulatedClock
from sim_backend.core_run.library import load
from sim_backend.core_run.parameters import parameters_of
from tests.helpers import bench

if TYPE_CHECKING:
    from tests.target.chip_image import Rows

AT_ONCE = 'supervisor.start="immediate"'
FED_FORWARD = "controller.friction_feedforward=true"
FILTER = 'observer.kind="friction_kalman"'
RIGS: tuple[tuple[str, ...], ...] = (
    (),
    (AT_ONCE, FED_FORWARD, "loop.rate_hz=10000"),
    (FILTER, AT_ONCE, "loop.rate_hz=500"),
    (AT_ONCE, 'supervisor.monitors="finite"', "loop.delay_samples=0", "reference.soft_start_s=0"),
    (AT_ONCE, "supervisor.position_limit_rad=4", "amplifier.slew_V_s=50", "amplifier.voltage_limit_V=2"),
    (FILTER, 'controller.position="measured"', "loop.rate_hz=2000"),
)


@functools.cache
def parameters(settings: tuple[str, ...]) -> Rows:
    """Return `struct run_parameters` of the shipped rig with some settings."""
    rig = bench(*settings)
    stages, recorder = assemble(rig, SimulatedClock(), [], in_line=True)
    recorder.close()
    return parameters_of(rig, stages, load())
