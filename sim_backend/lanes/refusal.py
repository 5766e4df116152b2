"""Reasons why lanes cannot run a rig, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.control.controllers.pd_compensated import PdSettings
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.config import Rig

_PLANT = "moreau"


def refusal(rig: Rig) -> str:
    """Return why lanes cannot run a rig, with the remedy; empty if they can."""
    return next(_reasons(rig), "")


def _reasons(rig: Rig) -> Iterator[str]:
    yield from _of_settings(rig)
    yield from _of_simulation(rig)


def _of_settings(rig: Rig) -> Iterator[str]:
    if rig.backend.kind != "sim":
        yield f'lanes simulate no wire: backend.kind is "{rig.backend.kind}". Set it to "sim".'
    if not isinstance(rig.observer, SuperTwistingSettings):
        yield f'lanes have the observer super_twisting alone; observer.kind is "{rig.observer.kind}".'
    if not isinstance(rig.controller, PdSettings):
        yield f'lanes have the controllers pd_compensated and pd; controller.kind is "{rig.controller.kind}".'
    if rig.supervisor.start != "immediate":
        yield 'lanes start at once. Set supervisor.start = "immediate".'
    if rig.run.end != "release":
        yield 'lanes have no way down at the end. Set run.end = "release".'
    if rig.controller.feeds_friction_forward and rig.sim.lost_samples:
        yield "lanes feed no friction forward where samples are lost. Set sim.lost_samples = 0."


def _of_simulation(rig: Rig) -> Iterator[str]:
    sim = rig.sim
    if sim.integrator != _PLANT:
        yield f'lanes have the plant "{_PLANT}" alone; sim.integrator is "{sim.integrator}".'
    if getattr(sim, "engine", "core") != "core":
        yield f'lanes are the core; sim.engine is "{getattr(sim, "engine", "")}".'
    if sim.details is not None:
        yield "lanes have neither Stribeck friction nor bristles nor cogging (sim.stribeck_ratio and others)."
    if sim.encoder_edge_counts:
        yield "lanes have encoders with even edges alone. Set sim.encoder_edge_counts = 0."
