"""The parameters of a run in the core, from its rig and its stages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings, tune, watch_floor
from dcmp_hil.safety.chatter import block_cycles, limit_V_s
from dcmp_hil.safety.supervisor import Supervisor
from sim_backend.hardware import as_signed
from sim_backend.lanes.parameters import of_law, of_plant, of_supervisor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.control.observers.super_twisting import Tuning
    from dcmp_hil.loop import LoopStages
    from sim_backend.core_run.library import RunLibrary


def parameters_of(rig: Rig, stages: LoopStages, library: RunLibrary) -> NDArray[np.void]:
    """Return `struct run_parameters`, shape (1,).

    Parameters
    ----------
    rig, stages
        That are not refused.
    library
        Whose structures they are.
    """
    filled = np.zeros(1, library.structures["run_parameters"])
    values = values_of(rig, stages, library.constants)
    for name in filled.dtype.names or ():
        value = values[name]
        if isinstance(value, dict):
            for inner, number in value.items():
                filled[name][inner] = number
        else:
            filled[name] = value
    return filled


def values_of(rig: Rig, stages: LoopStages, constants: Mapping[str, int]) -> dict[str, Any]:
    """Return the parameters by the names of run.h, and some more that lanes have."""
    return {**of_plant(rig), **of_law(rig), **_of_rig(rig), **_of_observers(rig, stages, constants)} | (
        _of_supervisor(rig, stages)
    )


def _of_rig(rig: Rig) -> dict[str, Any]:
    return {
        "period": rig.period,
        "plant_steps": rig.plant_steps,
        "plant_position": rig.sim.position_rad,
        "seed": as_signed(rig.sim.seed),
        "delay_samples": rig.loop.delay_samples,
        "delay": rig.delay,
        "measured": rig.controller.position == "measured",
        "feedforward": rig.controller.feeds_friction_forward,
        "soft_start": rig.reference.soft_start_s,
    }


def _of_observers(rig: Rig, stages: LoopStages, constants: Mapping[str, int]) -> dict[str, Any]:
    context, settings = rig.observer_context, rig.observer
    usual = SuperTwistingSettings.model_construct()
    floor = watch_floor(context.counts_per_rev, context.period)
    watch = tune(context, L1=usual.L1_1_s, L2=usual.L2_1_s2, M=None, mu0=floor)
    own = settings.tuning(context) if isinstance(settings, SuperTwistingSettings) else watch
    filters = isinstance(stages.observer, FrictionKalman)
    return {
        "observer_kind": constants["RUN_FRICTION_KALMAN" if filters else "RUN_SUPER_TWISTING"],
        "own": _of_r1(own, context),
        "friction": _of_filter(stages.observer),
        "watch": _of_r1(watch, context),
    }


def _of_r1(tuning: Tuning, context: ObserverContext) -> dict[str, Any]:
    L1, L2, M, mu0, nominal, gaps = tuning
    f0, cube = context.model.f0, mu0 * mu0 * mu0
    return {
        "L1": L1,
        "w1": L2 + f0 * L1,
        "w2": L1 + f0,
        "M": M,
        "mu0": mu0,
        "floor_from": M / cube if cube > 0.0 else math.inf,
        "steps": [number for step in (nominal, *gaps.values()) for number in step],
    }


_FILTER_NAMES = (
    *("f0", "gravity", "ku", "f1", "f_max", "f1_variance", "q", "half_count", "restart_after"),
    *("unchanged_variance", "edge_variance", "d_noise"),
)


def _of_filter(observer: object) -> dict[str, Any]:
    """Return the constants of the friction filter; none of another observer, and they stay 0."""
    if not isinstance(observer, FrictionKalman):
        return {}
    return {f"friction_{name}": one for name, one in zip(_FILTER_NAMES, observer.constants, strict=True)}


def _of_supervisor(rig: Rig, stages: LoopStages) -> dict[str, Any]:
    supervisor = stages.supervisor
    assert isinstance(supervisor, Supervisor)  # noqa: S101 - others are refused
    limiter, probe = supervisor.limiter, supervisor.probe
    bounds = limiter.bounds
    return {
        **of_supervisor(rig, exact_chatter=False),
        "watched": rig.supervisor.monitors == "all",
        "settle": supervisor.settle,
        "engage": supervisor.engage,
        "probes": probe is not None,
        "probe_ku": rig.model.ku_rad_s2_V,
        "probe_voltage": probe.push if probe else 0.0,
        "probe_gravity": rig.model.gravity_rad_s2,
        "governed": math.isfinite(bounds.position + bounds.velocity),
        "reference_braking": bounds.braking,
        "reference_strongest": bounds.strongest,
        "chatter_max": limit_V_s(limiter.chatter.expected) if limiter.chatter else math.inf,
        "chatter_cycles": block_cycles(rig.period),
    }
