"""What can be turned: every settable key with its value, its unit, what is allowed, and a slider's range."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.rules import within_reason
from dcmp_hil.config.units import in_words, split_unit
from dcmp_hil.live.settable import settable, value_of

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

_SLIDERS = {  # from, to; both above 0: by decades
    "kp_1_s2": (100.0, 20_000.0),
    "kd_1_s": (10.0, 400.0),
    "L1_1_s": (0.5, 50.0),
    "L2_1_s2": (0.5, 500.0),
    "M_rad_s3": (1.0, 2000.0),
    "amplitude_rad": (0.0, 3.0),
    "rate_rad_s": (0.05, 10.0),
    "from_hz": (0.0, 2.0),
    "to_hz": (0.05, 5.0),
    "sweep_s": (1.0, 60.0),
    "velocity_rad_s": (0.1, 10.0),
    "acceleration_rad_s2": (0.5, 50.0),
    "at_s": (0.0, 60.0),
    "rest_s": (0.0, 10.0),
}
_ANGLES = (-3.0, 3.0)
_SLOWEST = 5.0  # rad/s, of the slider for mu0
_NO_KIND = ("custom", "csv")


def knobs(rig: Rig) -> list[dict[str, Any]]:
    """Return what JSON can hold, in the order in which it is best shown."""
    return [_choice(rig, key) if key.endswith(".kind") else _number(rig, key) for key in settable(rig)]


def _choice(rig: Rig, key: str) -> dict[str, Any]:
    section = key.partition(".")[0]
    kinds = [kind for kind in KINDS[section] if kind not in _NO_KIND]
    return {"key": key, "value": value_of(rig, key), "choices": kinds}


def _number(rig: Rig, key: str) -> dict[str, Any]:
    section, _, name = key.partition(".")
    kind = type(getattr(rig, section))
    field = kind.model_fields[name]
    value = float(value_of(rig, key))
    low, high = within_reason(kind, name)
    start, end = _SLIDERS.get(name, _ANGLES)
    if name == "mu0_rad_s":
        high = min(high, 0.3 / rig.period)
        start, end = _SLOWEST, high
    return {
        "key": key,
        "value": value,
        "unit": in_words(split_unit(name)[1]),
        "meaning": (field.description or "").replace("\n", " "),
        "low": low,
        "high": high,
        "slider": [min(start, value) if value > 0.0 or start <= 0.0 else start, max(end, value)],
        "decades": start > 0.0 and math.isfinite(end),
    }
