"""Position, speed and acceleration that a reference requests, compared with the rig's limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.config.rig import Rig

_LOOK_AHEAD_S = 60.0  # s of a csv reference that are looked at where the run has no end
_WATCH_RATIO_MIN = 1.5  # of what pushes a healthy arm, that its watch needs
_HOLDING_TORQUE_SHARE_MAX = 0.95  # of the motor's torque, that holding the arm may take


def beyond_reach(rig: Rig) -> list[str]:
    """Return a sentence for each limit that the reference exceeds, and what is done instead."""
    return [] if rig.supervisor.monitors == "finite" else list(_beyond(rig))


def _beyond(rig: Rig) -> Iterator[str]:
    asked = rig.reference.peaks(rig.run.duration_s or _LOOK_AHEAD_S)
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
