"""Rules that span more than one table of rig.toml, or belong to no single key."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

from dcmp_hil.common.number_range import NumberRange, number
from dcmp_hil.config.formatting import range_of
from dcmp_hil.config.gain_rules import gains_hold
from dcmp_hil.config.units import in_words, split_unit
from dcmp_hil.control.observers.super_twisting import bandwidth_floor
from dcmp_hil.safety.speed_resolution import lowest_limit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.common.section import Section
    from dcmp_hil.config.tables import RigTables

_ENCODER_COUNTS_PER_REV_MIN = 256  # counts a revolution
_POSITION_LIMIT_MIN_RAD, _VELOCITY_LIMIT_MIN_RAD_S = 0.2, 2.0  # rad, rad/s
_FEWEST_COUNTS = 2  # from the encoder's middle to a limit of travel
_HOLDING_TORQUE_SHARE_MAX = 0.95  # of the motor's torque
_POSITIVE_MIN = 1e-6  # of any key that must be above 0
_PLAUSIBLE_MAX = {  # by unit: the largest plausible value
    "1_s": 1e5,
    "1_s2": 1e9,
    "rad_s3": 1e7,
    "rad_s2": 1e6,
    "rad_s": 1e4,
    "rad": 1e4,
    "hz": 1e4,
    "s": 1e6,
}


def _step_divides_period(rig: RigTables) -> str:
    if rig.sim.step_us == "auto":
        return ""
    steps = rig.period / (rig.sim.step_us * 1e-6)
    if steps >= 1 - 1e-9 and abs(steps - round(steps)) < 1e-6 * steps:
        return ""
    fits = rig.period * 1e6 / max(1, math.ceil(steps - 1e-9))
    return (
        f"sim.step_us: got {number(rig.sim.step_us)} us, which does not divide the period of "
        f"{rig.period * 1e6:g} us "
        f'(loop.rate_hz = {number(rig.loop.rate_hz)}). {fits:g} us would, or write "auto".'
    )


def _details_need_moreau(rig: RigTables) -> str:
    if rig.sim.integrator == "moreau" or rig.sim.details is None:
        return ""
    return (
        'sim.integrator: got "euler", the paper\'s own simulation, which has neither Stribeck friction nor '
        'bristles nor cogging. Write "moreau", or leave these keys of [sim] at 0.'
    )


def _samples_lost_where_there_is_no_wire(rig: RigTables) -> str:
    if not rig.sim.lost_samples or not rig.backend.device:
        return ""
    return (
        'sim.lost_samples: it is for backend.kind = "sim", which has no wire. With a wire, lose its '
        "frames: --fault wire.drop:p=0.05."
    )


def _friction_has_one_owner(rig: RigTables) -> str:
    if not (rig.controller.feeds_friction_forward and rig.observer.knows_friction):
        return ""
    return (
        f'controller.friction_feedforward: got true, and observer.kind = "{rig.observer.kind}" compensates '
        "friction already. Set it to false, or take another observer."
    )


def _floor_below_rate(rig: RigTables) -> str:
    mu0 = getattr(rig.observer, "mu0_rad_s", None)
    if mu0 is None or mu0 * rig.period <= 0.3 + 1e-9:
        return ""
    usual = bandwidth_floor(rig.encoder.counts, rig.period)
    return (
        f"observer.mu0_rad_s: got {number(mu0)} rad/s, too fast for loop.rate_hz = "
        f"{number(rig.loop.rate_hz)}: at most {0.3 / rig.period:g} rad/s. "
        f"Leave the key out to get {usual:.3g} rad/s, or raise the rate."
    )


def _simulation_only(rig: RigTables) -> str:
    kind = rig.backend.kind
    if not rig.backend.device:
        return ""  # a module:Factory says for itself whether it is a simulation, when it is opened
    loose = rig.impossible_on_a_wire if rig.backend.simulated else rig.simulation_only
    if not loose:
        return ""
    return (
        f'backend.kind: got "{kind}", but {", ".join(loose)} is for simulation '
        'only. Set backend.kind = "sim", or start from the rig bench-1khz.'
    )


def _whole_units(rig: RigTables) -> str:
    """Refuse what a device cannot say in whole numbers."""
    if not rig.backend.device:
        return ""
    faults = []
    period_us, counts = rig.period * 1e6, rig.encoder.counts
    if abs(period_us - round(period_us)) > 1e-6 * period_us:
        faults.append(
            f"loop.rate_hz: got {number(rig.loop.rate_hz)}, a period of {period_us:.9g} us; "
            f"a device has whole microseconds. {number(1e6 / round(period_us))} would do."
        )
    if counts is not None and counts != round(counts):
        faults.append(
            f"encoder.counts_per_rev: got {number(counts)}; a device has whole counts. "
            f"{round(counts)} would do."
        )
    return "\n".join(faults)


def _link_carries_rate(rig: RigTables) -> str:
    capacity = rig.backend.capacity
    if capacity is None or capacity.bits_per_period * rig.loop.rate_hz <= capacity.bits_per_second:
        return ""
    most = capacity.bits_per_second / capacity.bits_per_period
    return (
        f"backend.{capacity.key}: got {capacity.bits_per_second} bit/s, which carries {most:.0f} periods a "
        f"second; loop.rate_hz = {number(rig.loop.rate_hz)} needs "
        f"{math.ceil(capacity.bits_per_period * rig.loop.rate_hz)} bit/s."
    )


def _encoder_shows_faults(rig: RigTables) -> str:
    """Refuse an encoder so coarse that a fault of it is found too late; see docs/safety.md."""
    counts = rig.encoder.counts
    if counts is None or counts >= _ENCODER_COUNTS_PER_REV_MIN or rig.supervisor.monitors != "all":
        return ""
    return (
        f"encoder.counts_per_rev: got {number(counts)}; below {_ENCODER_COUNTS_PER_REV_MIN} a stuck encoder "
        "or lost motor power is found later than the 600 ms that are promised. Count all four edges "
        '(quadrature), or take a finer encoder; in simulation supervisor.monitors = "finite" runs without '
        "the watch."
    )


def _limits_leave_room(rig: RigTables) -> str:
    """Refuse limits that the start alone would pass: the probe's two pushes, and an arm that swings back."""
    limits, faults = rig.supervisor, []
    if limits.monitors != "all" or limits.start == "immediate" or limits.probe == "off":
        return ""
    if limits.position_limit_rad < _POSITION_LIMIT_MIN_RAD:
        faults.append(
            f"supervisor.position_limit_rad: got {number(limits.position_limit_rad)}; at least "
            f"{number(_POSITION_LIMIT_MIN_RAD)} rad: the probe before the start moves the arm by up to "
            "0.1 rad."
        )
    if limits.velocity_limit_rad_s < _VELOCITY_LIMIT_MIN_RAD_S:
        faults.append(
            f"supervisor.velocity_limit_rad_s: got {number(limits.velocity_limit_rad_s)}; at least "
            f"{number(_VELOCITY_LIMIT_MIN_RAD_S)} rad/s: the probe before the start moves the arm at up to "
            "1 rad/s."
        )
    return "\n".join(faults)


def _limits_can_be_kept(rig: RigTables) -> str:
    """Refuse limits that the encoder does not show; see docs/safety.md."""
    limits, count = rig.supervisor, rig.encoder.count
    if limits.monitors != "all":
        return ""
    faults = []
    speed = lowest_limit(count, rig.period)
    if limits.velocity_limit_rad_s < speed:
        faults.append(
            f"supervisor.velocity_limit_rad_s: got {number(limits.velocity_limit_rad_s)}; at least "
            f"{number(_rounded_up(speed))} rad/s: a speed below two counts of the encoder in 8 ms cannot be "
            "kept. Raise it, or take a finer encoder."
        )
    travel = _FEWEST_COUNTS * count + _way_to_0_V(rig)
    if limits.position_limit_rad < travel:
        faults.append(
            f"supervisor.position_limit_rad: got {number(limits.position_limit_rad)}; at least "
            f"{number(_rounded_up(travel))} rad: the motor moves the arm as far before the voltage is 0. "
            "Raise it, or the rate, or lower supervisor.velocity_limit_rad_s."
        )
    return "\n".join(faults)


def _way_to_0_V(rig: RigTables) -> float:
    """Return how far the arm goes from the sample that shows a limit passed until the voltage is 0, rad.

    At the velocity limit, or as fast as the motor and gravity can make it within a travel of that length.
    """
    late = (rig.loop.delay_samples + 1) * rig.period
    strongest = rig.model.ku_rad_s2_V * rig.amplifier.limit + abs(rig.model.gravity_rad_s2)
    return min(rig.supervisor.velocity_limit_rad_s * late, 2.0 * strongest * late**2)


def _rounded_up(value: float) -> float:
    """Return a limit that can be written as it is printed."""
    return math.ceil(1e3 * value - 1e-6) / 1e3


def _motor_holds(rig: RigTables) -> str:
    """Refuse a motor that what pushes all the time carries away."""
    model, motor = rig.model, rig.model.ku_rad_s2_V * rig.amplifier.limit
    pushed = abs(model.eta_rad_s2) + abs(model.eta_amplitude_rad_s2)
    if rig.supervisor.monitors != "all" or pushed <= max(model.f1_rad_s2, _HOLDING_TORQUE_SHARE_MAX * motor):
        return ""
    return (
        f"model.eta_rad_s2: got {number(model.eta_rad_s2)}; with model.eta_amplitude_rad_s2 a push of up to "
        f"{pushed:.4g} rad/s2, and the motor has {motor:.4g} at amplifier.voltage_limit_V: nothing would "
        "hold the arm. Check the three, and model.ku_rad_s2_V."
    )


def _supply_gives_limit(rig: RigTables) -> str:
    limit, supply = rig.amplifier.limit, 1e-3 * rig.amplifier.supply_mV
    if supply == 0.0 or math.isinf(limit) or limit <= supply:
        return ""
    return (
        f"amplifier.voltage_limit_V: got {number(limit)}, more than amplifier.supply_V = {number(supply)} "
        "gives. Lower it, or correct the supply."
    )


def _within_reason(rig: RigTables) -> str:
    """Refuse what only a wrong unit explains, in the tables that do not say how large their keys may be."""
    sections: dict[str, Section] = {
        "observer": rig.observer,
        "controller": rig.controller,
        "reference": rig.reference,
    }
    return "\n".join(
        fault for name, section in sections.items() for fault in _beyond_reason(name, section) if fault
    )


def own_bounds(section: type[Section], key: str) -> NumberRange:
    """Return the bounds that a table states for one of its keys; infinite where it states none."""
    described = section.model_json_schema()["properties"][key]
    return range_of(
        {name: bound for one in (described, *described.get("anyOf", ())) for name, bound in one.items()}
    )


def within_reason(section: type[Section], key: str) -> tuple[float, float]:
    """Return the smallest and the largest number that a key of a table may have, infinite without a unit."""
    own = own_bounds(section, key)
    largest = _PLAUSIBLE_MAX.get(split_unit(key)[1], math.inf)
    low = _POSITIVE_MIN if own.low == 0.0 and own.low_excluded else max(own.low, -largest)
    return low, min(own.high, largest)


def _beyond_reason(name: str, section: Section) -> Iterator[str]:
    for key, plausible in _plausible_ranges(type(section)):
        value, allowed = getattr(section, key), plausible
        if not isinstance(value, float) or allowed.holds(value):
            continue
        if allowed.low < 0.0:  # name the bound that it is beyond
            allowed = NumberRange(high=allowed.high) if value > allowed.high else NumberRange(allowed.low)
        expected, field = allowed.words(in_words(split_unit(key)[1])), type(section).model_fields[key]
        yield f"{name}.{key}: got {number(value)}; expected {expected}. {field.description}"


@cache
def _plausible_ranges(section: type[Section]) -> list[tuple[str, NumberRange]]:
    """Return the keys of a table whose unit says how large they may be, and from where to where."""
    found = []
    for key, field in section.model_fields.items():
        largest = _PLAUSIBLE_MAX.get(split_unit(key)[1], math.nan)
        positive = any(getattr(bound, "gt", None) == 0 for bound in field.metadata)
        found.append((key, NumberRange(_POSITIVE_MIN if positive else -largest, largest)))
    return [(key, allowed) for key, allowed in found if not math.isnan(allowed.high)]


RULES: tuple[Callable[[RigTables], str], ...] = (
    _within_reason,
    _step_divides_period,
    _details_need_moreau,
    _samples_lost_where_there_is_no_wire,
    _friction_has_one_owner,
    _floor_below_rate,
    _simulation_only,
    _whole_units,
    _link_carries_rate,
    _supply_gives_limit,
    _encoder_shows_faults,
    _limits_leave_room,
    _limits_can_be_kept,
    _motor_holds,
    gains_hold,
)
"""Each returns its faults, one a line, beginning with the key; empty if there is none."""
OPEN_LOOP_RULES = (_within_reason,)
"""Those of them that hold where no loop is closed."""
