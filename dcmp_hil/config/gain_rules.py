"""Whether the loop of a rig is stable, and what one count of its encoder costs: rules for gains."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from dcmp_hil.common.number_range import number
from dcmp_hil.config.formatting import toml_value
from dcmp_hil.control.controllers.pd_compensated import PdSettings
from dcmp_hil.control.observers.settings import ObserverLimits, ObserverSettings
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings
from dcmp_hil.control.stability import LinearLoop, LoopSpec, bandwidths
from dcmp_hil.safety.chatter import FLOOR_V_S

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config.tables import RigTables

MOTOR_GAIN_RATIO_MIN = 0.8  # times the believed motor gain, for which the loop must be stable
MOTOR_GAIN_RATIO_MAX = 1.25  # the same, upper bound
NOISE_VOLTAGE_SHARE_MAX = 0.25
"""Of the voltage limit, that the encoder's count alone may cost (standard deviation)."""
_GAIN_KEYS = (
    ("loop", "rate_hz"),
    ("loop", "delay_samples"),
    ("amplifier", "voltage_limit_V"),
    ("encoder", "counts_per_rev"),
    ("model", "ku_rad_s2_V"),
    ("model", "f0_1_s"),
    ("model", "gravity_rad_s2"),
    ("controller", "position"),
    ("controller", "kp_1_s2"),
    ("controller", "kd_1_s"),
    ("observer", "L1_1_s"),
    ("observer", "L2_1_s2"),
    ("observer", "mu0_rad_s"),
    ("observer", "M_rad_s3"),
)


def gains_hold(rig: RigTables) -> str:
    """Refuse gains with which the loop runs away, or shakes the motor with the encoder's own steps."""
    fault = _fault(rig)
    return f"{_blamed(rig)} {fault()}" if fault else ""


def holds(rig: RigTables) -> bool:
    """Return whether `gains_hold` finds nothing wrong."""
    return _fault(rig) is None


def loops(rig: RigTables) -> list[LinearLoop]:
    """Return the linear loop at every bandwidth that the observer has; empty for classes of one's own."""
    if not (isinstance(rig.controller, PdSettings) and isinstance(rig.observer, SuperTwistingSettings)):
        return []
    model, count = rig.model.values(), rig.encoder.count
    spec = LoopSpec(model, rig.period, rig.loop.delay_samples, rig.controller.position == "measured", count)
    tuning = rig.observer.tuning_of_a_period(rig.observer_context)
    return [LinearLoop(spec, rig.controller.gains, tuning, mu) for mu in bandwidths(tuning, count)]


def observer_limits(rig: RigTables) -> ObserverLimits:
    """Return the facts of a rig that limit the gains of an observer."""
    torque = rig.model.ku_rad_s2_V * rig.amplifier.limit
    return ObserverLimits(rig.encoder.count, rig.supervisor.velocity_limit_rad_s, torque)


def observer_fault(rig: RigTables) -> str:
    """Return what the observer itself finds wrong with its gains on this rig; nothing without the watch."""
    if rig.supervisor.monitors != "all" or not isinstance(rig.observer, ObserverSettings):
        return ""
    return rig.observer.fault(rig.observer_context, observer_limits(rig))


def _fault(rig: RigTables) -> Callable[[], str] | None:
    """Return a function that describes the fault, None without one; only it computes the margins."""
    if rig.supervisor.monitors != "all":
        return None
    if fault := observer_fault(rig):
        return partial(str, fault)
    for loop in loops(rig):
        if not (loop.stable() and loop.stable(MOTOR_GAIN_RATIO_MIN) and loop.stable(MOTOR_GAIN_RATIO_MAX)):
            return partial(_unstable, loop)
        if math.isfinite(rig.amplifier.limit) and (fault := _rough(loop, rig.amplifier.limit)):
            return partial(_told, fault, loop)
    return None


def _rough(loop: LinearLoop, limit: float) -> str:
    """Return a fault if the encoder's steps alone shake the voltage too much, in V and V/s."""
    (noise, _), variation = loop.noise_V(), loop.variation_V_s()
    if noise > NOISE_VOLTAGE_SHARE_MAX * limit:
        return (
            f"with these gains the encoder's steps alone make the voltage shake by {noise:.2g} V "
            f"(standard deviation); at most {NOISE_VOLTAGE_SHARE_MAX * limit:.3g} V, a quarter of "
            "amplifier.voltage_limit_V"
        )
    if variation >= FLOOR_V_S:
        return (
            f"with these gains the encoder's steps alone make the voltage change by {variation:,.0f} V/s on "
            f"average, and from {FLOOR_V_S:,.0f} V/s on it is chatter"
        )
    return ""


def _unstable(loop: LinearLoop) -> str:
    margins, reserve = loop.margins(), ""
    if (robust := loop.robustness()) is not None:
        reserve = f", with a margin of phase of {robust.phase_deg:.0f} degrees"
    gains = f"{number(MOTOR_GAIN_RATIO_MIN)} to {number(MOTOR_GAIN_RATIO_MAX)} times"
    needed = f"{gains} model.ku_rad_s2_V are needed"
    remedy = "Leave out the gains that were changed to get those that fit, or raise loop.rate_hz."
    if margins is None:
        return f"the loop is not stable with these gains, for any gain of the motor: {needed}. {remedy}"
    return (
        f"the loop is stable for motor gains of {margins.low:.2f} to {margins.high:.2f} times "
        f"model.ku_rad_s2_V only{reserve}; {needed}. {remedy}"
    )


def _told(fault: str, loop: LinearLoop) -> str:
    """Return a fault in words, with the margin of stability."""
    margins, robust = loop.margins(), loop.robustness()
    stable = "it is not stable"
    if margins is not None and robust is not None:
        stable = (
            f"it is stable for motor gains of {margins.low:.2f} to {margins.high:.2f} times "
            f"model.ku_rad_s2_V, with a margin of phase of {robust.phase_deg:.0f} degrees"
        )
    return (
        f"{fault}; {stable}. Lower controller.kd_1_s, observer.mu0_rad_s, observer.L1_1_s or "
        "observer.M_rad_s3."
    )


def _blamed(rig: RigTables) -> str:
    """Return the key that alone makes the difference; else the proportional gain."""
    for table, name in _GAIN_KEYS:
        section = getattr(rig, table)
        if name not in section.model_fields_set:
            continue
        default = type(section).model_fields[name].default
        usual = rig.model_copy(update={table: section.model_copy(update={name: default})})
        if holds(usual):
            got = getattr(section, name)
            return f"{table}.{name}: got {toml_value(got) if isinstance(got, str) else number(got)};"
    return "controller.kp_1_s2:"
