"""The rule for gains over many rigs at once: those that are right beyond doubt are found in microseconds."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.config.gain_rules import (
    MOTOR_GAIN_RATIO_MAX,
    MOTOR_GAIN_RATIO_MIN,
    NOISE_VOLTAGE_SHARE_MAX,
    gains_hold,
    loops,
    observer_fault,
)
from dcmp_hil.control.many_loops import ManyLoops
from dcmp_hil.safety.chatter import FLOOR_V_S

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.config.rig import Rig
    from dcmp_hil.control.stability import LinearLoop

_DOUBT = 1e-6  # of a limit: nearer to it, the rule itself decides


def gain_faults(rigs: Sequence[Rig]) -> list[str]:
    """Return what `gains_hold` returns of each rig, in a fraction of its time where nothing is wrong."""
    doubtful = {number for number, rig in enumerate(rigs) if observer_fault(rig)}
    groups: dict[tuple[object, ...], list[tuple[int, LinearLoop]]] = defaultdict(list)
    for number, rig in enumerate(rigs):
        for loop in loops(rig) if rig.supervisor.monitors == "all" and number not in doubtful else ():
            groups[loop.spec.period, loop.spec.delay_samples, loop.spec.measured].append((number, loop))
    for members in groups.values():
        limits = np.array([rigs[number].amplifier.limit for number, _ in members])
        sure = _surely_right([loop for _, loop in members], limits)
        doubtful |= {number for (number, _), right in zip(members, sure, strict=True) if not right}
    return [gains_hold(rig) if number in doubtful else "" for number, rig in enumerate(rigs)]


def _surely_right(
    members: list[LinearLoop], limits: np.ndarray[tuple[int], np.dtype[np.float64]]
) -> list[bool]:
    many = ManyLoops(members)
    sure = many.surely_stable(1.0)
    sure &= many.surely_stable(MOTOR_GAIN_RATIO_MIN) & many.surely_stable(MOTOR_GAIN_RATIO_MAX)
    noise, variation = many.noise()
    quiet = (noise < (1.0 - _DOUBT) * NOISE_VOLTAGE_SHARE_MAX * limits) & (
        variation < (1.0 - _DOUBT) * FLOOR_V_S
    )
    found: list[bool] = (sure & (quiet | np.isinf(limits))).tolist()
    return found
