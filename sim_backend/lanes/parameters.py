"""The numbers of a lane, from its rig."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.assembly import make_limiter, make_outlier_filter
from dcmp_hil.config.variation import expected_variation
from dcmp_hil.control.controllers.pd_compensated import PdSettings
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings, Tuning, tune, watch_floor
from dcmp_hil.control.predictor import held_input
from dcmp_hil.safety.chatter import FLOOR_V_S, limit_V_s
from dcmp_hil.safety.monitors import RangeMonitor, cycles_above, filter_keep
from dcmp_hil.safety.reference_governor import JUMP_MAX_RAD
from dcmp_hil.safety.speed_resolution import resolution

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.config import Rig
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.safety.reference_governor import Bounds

_WORD = 0xFFFF_FFFF
_GAPS = 10
_HALVINGS = 60  # of an interval, until its ends are neighbours
_STEP_NAMES = ("f12", "f22", "gu1", "gu2", "h01", "h02", "h11", "h12", "k1", "k2", "k3")


class LaneNumbers(NamedTuple):
    """Numbers of one lane, by the names of lanes.h.

    Parameters
    ----------
    parameters
        Of `struct lanes_parameters`.
    own, watch
        Of `struct lanes_observer`: the run's observer and the one that watches.
    gap_steps
        Constants of steps of 1 to 10 periods, of both observers; empty where no sample is lost.
    """

    parameters: Mapping[str, float]
    own: Mapping[str, float]
    watch: Mapping[str, float]
    gap_steps: tuple[tuple[tuple[float, ...], ...], ...]


def lane_numbers(rig: Rig, *, exact_chatter: bool) -> LaneNumbers:
    """Work out the numbers of the lane of a rig.

    Parameters
    ----------
    rig
        That lanes do not refuse.
    exact_chatter
        Whether the limit of the voltage's variation is this rig's own, which takes milliseconds; else it is
        the lowest that any rig has.
    """
    context = rig.observer_context
    longest = _GAPS if rig.sim.lost_samples else 1
    assert isinstance(rig.observer, SuperTwistingSettings)  # noqa: S101 - others are refused
    observer = rig.observer
    own = _tuned(context, observer.L1_1_s, observer.L2_1_s2, observer.M_rad_s3, observer.mu0_rad_s, longest)
    usual = SuperTwistingSettings.model_construct()
    floor = watch_floor(context.counts_per_rev, context.period)
    watch = _tuned(context, usual.L1_1_s, usual.L2_1_s2, None, floor, longest)
    gaps = tuple((one.nominal, *one.gaps.values()) for one in (own, watch)) if rig.sim.lost_samples else ()
    return LaneNumbers(
        of_plant(rig) | of_law(rig) | of_supervisor(rig, exact_chatter=exact_chatter),
        _of_observer(own, context.model.f0),
        _of_observer(watch, context.model.f0),
        gaps,
    )


@functools.lru_cache(maxsize=1024)
def _tuned(
    context: ObserverContext, L1: float, L2: float, M: float | None, mu0: float | None, longest: int
) -> Tuning:
    return tune(context, L1=L1, L2=L2, M=M, mu0=mu0, longest=longest)


def _of_observer(tuning: Tuning, f0: float) -> dict[str, float]:
    L1, L2, M, mu0, nominal, _ = tuning
    cube = mu0 * mu0 * mu0
    return {
        "L1": L1,
        "w1": L2 + f0 * L1,
        "w2": L1 + f0,
        "M": M,
        "mu0": mu0,
        "floor_from": M / cube if cube > 0.0 else math.inf,
        **dict(zip(_STEP_NAMES, nominal, strict=True)),
    }


def of_plant(rig: Rig) -> dict[str, float]:
    """Return the numbers of the simulated rig."""
    plant, sim = rig.plant, rig.sim
    return {
        "plant_f0": plant.f0,
        "plant_f1": plant.f1,
        "plant_gravity": plant.gravity,
        "plant_ku": plant.ku,
        "plant_eta": plant.eta,
        "plant_eta_amplitude": plant.eta_amplitude,
        "plant_eta_rate": plant.eta_rate,
        "plant_step": rig.period / rig.plant_steps,
        "count": rig.encoder.count,
        "phase": sim.encoder_phase_counts,
        "noise": sim.encoder_noise_counts,
        "seed_low": sim.seed & _WORD,
        "seed_high": sim.seed >> 32 & _WORD,
        "lost": sim.lost_samples,
        "amplifier_limit": rig.amplifier.limit,
        "amplifier_slew": rig.amplifier.slew * rig.period,
        "dead_zone": sim.dead_zone_V,
        "quantum": sim.voltage_step_mV * 1e-3,
    }


def of_law(rig: Rig) -> dict[str, float]:
    """Return the numbers of model, predictor and controller."""
    model = rig.model.values()
    a, p1, p2 = held_input(model.f0, rig.period)
    assert isinstance(rig.controller, PdSettings)  # noqa: S101 - others are refused
    kp, kd, compensation = rig.controller.gains
    return {
        "f0": model.f0,
        "f1": model.f1,
        "ku": model.ku,
        "volts": 1.0 / model.ku,
        "a": a,
        "p1": p1,
        "p2": p2,
        "kp": kp,
        "kd": kd,
        "compensation": compensation,
    }


def of_supervisor(rig: Rig, *, exact_chatter: bool) -> dict[str, float]:
    """Return the numbers of the supervisor; `exact_chatter` as for `lane_numbers`."""
    limits, period, count = rig.supervisor, rig.period, rig.encoder.count
    watched = limits.monitors == "all"
    bounds = make_limiter(rig, lambda _: None).bounds
    outliers = make_outlier_filter(rig)
    ranges = RangeMonitor(limits.position_limit_rad, limits.velocity_limit_rad_s, resolution(count, period))
    return {
        "slew": rig.amplifier.slew * period if watched else math.inf,
        "error_max": limits.error_limit if watched else math.inf,
        "reference_x_max": bounds.position,
        "reference_v_max": bounds.velocity,
        "reference_a_max": bounds.acceleration,
        "reference_stop": bounds.stop,
        "jump_x_max": _longest_jump(bounds),
        "position_max": limits.position_limit_rad,
        "velocity_max": ranges.velocity_max,
        "disturbance_max": limits.disturbance_limit_rad_s2,
        "disturbance_keep": filter_keep(period),
        "disturbance_cycles": cycles_above(period),
        "chatter_max": limit_V_s(expected_variation(rig)) if exact_chatter else FLOOR_V_S,
        "jump_usual": outliers.usual,
        "jump_speed": outliers.speed,
        "jump_floor": outliers.floor,
    }


def _longest_jump(bounds: Bounds) -> float:
    """Return the longest jump of a reference that is left to the controller, rad."""
    if bounds.short(JUMP_MAX_RAD):
        return JUMP_MAX_RAD
    low, high = 0.0, JUMP_MAX_RAD
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if bounds.short(middle) else (low, middle)
    return low
