"""A run in a few numbers and words, for clients outside of its process."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from dcmp_hil.ipc.run_end import AT_ZERO, LIVES
from dcmp_hil.safety.device_faults import meaning_of
from dcmp_hil.safety.supervisor import Phase

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.config import Rig
    from dcmp_hil.ipc.mailbox import Mailbox

CYCLE_AGE_MAX_S = 0.5
"""s, how old the newest cycle of a run that goes on may be."""
_PHASE_NAMES = tuple(phase.value for phase in Phase)


def state_of(row: Mapping[str, float], phase: int, rig: Rig, age: float = 0.0) -> dict[str, Any]:
    """Return the state of a run as a document for JSON.

    Parameters
    ----------
    row
        The newest of the ring; empty before the first.
    phase
        A place in the list of phases.
    rig
        As it runs.
    age
        s, since the newest row came. A run that is silent for longer than `CYCLE_AGE_MAX_S` is in no phase.
    """
    silent = bool(row) and age > CYCLE_AGE_MAX_S
    state = {
        "rig": rig.name,
        "t_s": row.get("t"),
        "age_s": age,
        "phase": "silent" if silent else phase_name(phase),
        "position_rad": row.get("position"),
        "velocity_rad_s": row.get("velocity_estimate"),
        "reference_rad": row.get("position_reference"),
        "voltage_V": row.get("voltage_applied"),
        "voltage_limit_V": rig.amplifier.limit,
        **_disturbance(row, rig),
        "error_mrad": _error_mrad(row),
        "lateness_us": 1e6 * row.get("lateness", math.nan),
        "fault": _fault(int(row.get("fault", 0.0))),
    }
    return {key: finite(value) for key, value in state.items()}


def end_of(mailbox: Mailbox) -> dict[str, Any]:
    """Return how a run ended, in words, whether 0 V was confirmed, and its last phase."""
    said = mailbox.last_words if mailbox.end != LIVES else ""
    return {
        "ended": said or "it died; the device goes to 0 V by itself.",
        "at_zero": mailbox.end == AT_ZERO,
        "last_phase": phase_name(mailbox.phase),
    }


def phase_name(number: int) -> str:
    """Return the phase at a place in the list of phases."""
    return _PHASE_NAMES[number] if 0 <= number < len(_PHASE_NAMES) else "unknown"


def _disturbance(row: Mapping[str, float], rig: Rig) -> dict[str, float | None]:
    """Return the estimate of the disturbance and what the model explains of it, rad/s2; see `Block`."""
    whole = row.get("disturbance_estimate")
    gravity = friction = rest = None
    if whole is not None:
        model, velocity = rig.model.values(), row["velocity_estimate"]
        gravity = -model.gravity * _sine(row["position_estimate"])
        friction = -math.copysign(model.f1, velocity) if velocity else 0.0
        rest = whole - gravity - friction
    return {
        "disturbance_rad_s2": whole,
        "gravity_rad_s2": gravity,
        "friction_rad_s2": friction,
        "rest_rad_s2": rest,
    }


def _sine(angle: float) -> float:
    """Return the sine, NaN of an infinite angle: the last row of a trip may hold one."""
    return math.sin(angle) if math.isfinite(angle) else math.nan


def _error_mrad(row: Mapping[str, float]) -> float | None:
    """Return position minus reference at one instant; None before there is anything to track."""
    if not row or row["t"] < row["began"]:
        return None
    return 1e3 * (row["position"] - row["position_reference"])


def _fault(code: int) -> str:
    if not code:
        return ""
    meaning = meaning_of(code)
    return f"{meaning.sentence}. {meaning.remedy}"


def finite(value: Any) -> Any:
    """Return a value for JSON, which has no infinity and no NaN: None in their place."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
