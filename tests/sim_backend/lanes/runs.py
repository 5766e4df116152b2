"""Rigs for lanes, drawn by a seed, and what the plain loop says of them."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from dcmp_hil import load_rig
from dcmp_hil.sweeping.plain_loop import PlainLoop

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.sweeping.engine import RunOutcome
    from sim_backend.lanes.engine import LaneEngine

CASES: dict[str, tuple[str, ...]] = {
    "nominal": (),
    "saturated": ("amplifier.voltage_limit_V=3.2", "amplifier.slew_V_s=60"),
    "lost samples": ("sim.lost_samples=0.1",),
    "1024 counts": ("encoder.counts_per_rev=1024",),
    "65536 counts": ("encoder.counts_per_rev=65536",),
    "ideal encoder": ("encoder.counts_per_rev=ideal",),
    "noise": ("sim.encoder_noise_counts=1.5",),
    "delay 0": ("loop.delay_samples=0",),
    "most samples lost": ("sim.lost_samples=0.8", "loop.delay_samples=0"),
    "finite monitors, fine steps": ("supervisor.monitors=finite", "sim.step_us=50"),
    "friction fed forward": ("controller.friction_feedforward=true", "controller.position=measured"),
    "amplifier with steps": ("sim.dead_zone_V=0.05", "sim.voltage_step_mV=20", "controller.kind=pd"),
    "step": ("reference.kind=step", "reference.at_s=0.7", "reference.soft_start_s=0.3"),
}
"""Overrides of healthy runs."""
TRIPS: dict[str, tuple[tuple[str, ...], set[str]]] = {
    "pushed": (("sim.plant.eta_rad_s2=60",), {"disturbance"}),
    "without power": (("sim.plant.ku_rad_s2_V=0.05",), {"power", "stuck"}),
    "too strong": (("sim.plant.ku_rad_s2_V=20",), {"disturbance"}),
    "fast": (("supervisor.disturbance_limit_rad_s2=1e6", "sim.plant.eta_rad_s2=140"), {"speed"}),
    "far": (
        (
            "supervisor.disturbance_limit_rad_s2=1e6",
            "sim.plant.eta_rad_s2=70",
            "supervisor.position_limit_rad=1.3",
        ),
        {"travel"},
    ),
    "weak": (("amplifier.voltage_limit_V=1.5", "reference.rate_rad_s=1.2"), {"saturation"}),
    "astray": (
        ("supervisor.error_limit_rad=0.02", "controller.kp_1_s2=30", "controller.kind=pd"),
        {"tracking"},
    ),
    "noisy": (("sim.encoder_noise_counts=9", "supervisor.disturbance_limit_rad_s2=5000"), {"chatter"}),
}
"""Overrides of runs that the supervisor ends, and why."""

REPEATED: dict[str, tuple[str, ...]] = {
    "led": (
        "reference.kind=step",
        "reference.at_s=0.2",
        "reference.after_rad=2.5",
        "reference.soft_start_s=0.1",
    ),
    "jumping": ("sim.encoder_noise_counts=150", "supervisor.disturbance_limit_rad_s2=1e5"),
}
"""Overrides of runs that lanes leave to the plain loop."""


def rig_of(*overrides: str) -> Rig:
    """Return a rig that starts at once."""
    return load_rig("bench-1khz", ["supervisor.start=immediate", *overrides])


def drawn(number: int, overrides: Sequence[str], seed: int = 1) -> list[Rig]:
    """Draw so many rigs around the overrides, which come last."""
    rng = random.Random(seed)
    return [
        rig_of(
            f"sim.encoder_phase_counts={rng.random()!r}",
            f"sim.position_rad={rng.uniform(-0.3, 0.3)!r}",
            f"sim.plant.f1_rad_s2={rng.uniform(0.8, 1.8)!r}",
            f"sim.plant.ku_rad_s2_V={rng.uniform(4.6, 6.2)!r}",
            f"sim.seed={rng.randrange(10**12)}",
            *overrides,
        )
        for _ in range(number)
    ]


def unequal(engine: LaneEngine, rigs: Sequence[Rig], duration: float) -> list[tuple[RunOutcome, RunOutcome]]:
    """Return the pairs of outcomes, by lanes and by the plain loop, that differ in any bit."""
    found = zip(engine.run(rigs, duration), PlainLoop(plain=True).run(rigs, duration), strict=True)
    return [(ours, plain) for ours, plain in found if repr(ours) != repr(plain)]
