"""Position, speed and acceleration that a reference requests, compared with the rig's limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.control.references.periodic import Chirp, Sine
from dcmp_hil.control.references.piecewise import Hold, Step, Trapezoid

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.config.rig import Rig

_LOOK_AHEAD_S = 60.0  # s of a csv reference that are looked at where the run has no end
_REFERENCE_POINTS = 2000
_WATCH_RATIO_MIN = 1.5  # of what pushes a healthy arm, that its watch needs
_HOLDING_TORQUE_SHARE_MAX = 0.95  # of the motor's torque, that holding the arm may take


class Peaks(NamedTuple):
    """The largest of what a reference asks for, either way."""

    position: float  # rad
    velocity: float  # rad/s
    acceleration: float  # rad/s2


def peaks(rig: Rig) -> Peaks:
    """Return what the reference of a rig asks for once it has faded in."""
    reference = rig.reference
    if isinstance(reference, Sine):
        amplitude, rate = reference.amplitude_rad, reference.rate_rad_s
        return Peaks(abs(reference.offset_rad) + amplitude, amplitude * rate, amplitude * rate * rate)
    if isinstance(reference, Chirp):
        amplitude = reference.amplitude_rad
        rate = math.tau * max(reference.from_hz, reference.to_hz)
        slope = math.tau * abs(reference.to_hz - reference.from_hz) / reference.sweep_s
        farthest = abs(reference.offset_rad) + amplitude
        return Peaks(farthest, amplitude * rate, amplitude * max(rate * rate, slope))
    if isinstance(reference, Hold):
        return Peaks(abs(reference.position_rad), 0.0, 0.0)
    if isinstance(reference, Step):
        return Peaks(max(abs(reference.before_rad), abs(reference.after_rad)), 0.0, 0.0)
    if isinstance(reference, Trapezoid):
        low, high = reference.low_rad, reference.high_rad
        hardest = reference.acceleration_rad_s2 if low != high else 0.0
        fastest = min(reference.velocity_rad_s, math.sqrt(abs(high - low) * hardest))
        return Peaks(max(abs(low), abs(high)), fastest, hardest)
    length = rig.run.duration_s or _LOOK_AHEAD_S
    looks = [reference.at(length * k / _REFERENCE_POINTS) for k in range(_REFERENCE_POINTS + 1)]
    return Peaks(*(max(map(abs, column)) for column in zip(*looks, strict=True)))


def beyond_reach(rig: Rig) -> list[str]:
    """Return a sentence for each limit that the reference exceeds, and what is done instead."""
    return [] if rig.supervisor.monitors == "finite" else list(_beyond(rig))


def _beyond(rig: Rig) -> Iterator[str]:
    asked = peaks(rig)
    position, velocity = rig.supervisor.reference_limits
    if not asked.position <= position:
        yield f"reference: it leaves supervisor.position_limit_rad and will be held at {position:.4g} rad."
    if not asked.velocity <= velocity:
        yield (
            f"reference: it asks for {asked.velocity:.4g} rad/s, more than supervisor.velocity_limit_rad_s "
            f"leaves it; it will be limited to {velocity:.4g} rad/s."
        )
    hardest = rig.reference_accelerations[0]
    if not asked.acceleration <= hardest:
        yield (
            f"reference: it asks for {asked.acceleration:.4g} rad/s2, more than the motor can follow with "
            f"amplifier.voltage_limit_V; it will be limited to {hardest:.4g} rad/s2."
        )
    yield from _unexplained(rig, min(asked.position, position))
    motor, pushed = rig.model.ku_rad_s2_V * rig.amplifier.limit, _pushed(rig, min(asked.position, position))
    if not pushed <= _HOLDING_TORQUE_SHARE_MAX * motor:
        yield (
            f"reference: the arm cannot be held there: gravity and the constant push are up to {pushed:.4g} "
            f"rad/s2, the motor has {motor:.4g} at amplifier.voltage_limit_V."
        )


def _unexplained(rig: Rig, position: float) -> Iterator[str]:
    """Compare what pushes a healthy arm with what the watch takes for a fault: it knows no gravity."""
    limit, seen = rig.supervisor.disturbance_limit_rad_s2, _pushed(rig, position) + rig.model.f1_rad_s2
    if not seen <= limit:
        yield (
            f"reference: gravity, friction and the constant push are up to {seen:.4g} rad/s2 there, and the "
            f"watch ends the run at supervisor.disturbance_limit_rad_s2 = {limit:.4g}. Set that to "
            f"{_WATCH_RATIO_MIN * seen:.3g}, or stay nearer to hanging."
        )


def _pushed(rig: Rig, position: float) -> float:
    model = rig.model
    falls = model.gravity_rad_s2 * math.sin(min(position, 0.5 * math.pi))
    return falls + abs(model.eta_rad_s2) + abs(model.eta_amplitude_rad_s2)
