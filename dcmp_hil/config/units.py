"""Units at the end of a key: recognising the right quantity in the wrong one."""

from __future__ import annotations

import math

_UNIT_FAMILIES: tuple[dict[str, float], ...] = (
    {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3},
    {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    {"hz": 1.0, "khz": 1e3},
    {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "turns": math.tau, "rev": math.tau},
    {"rad_s": 1.0, "mrad_s": 1e-3, "deg_s": math.pi / 180, "rpm": math.tau / 60, "hz": math.tau},
    {"rad_s2": 1.0, "deg_s2": math.pi / 180},
    {"V_s": 1.0, "mV_s": 1e-3, "V_ms": 1e3},
    {"1_s": 1.0},
    {"1_s2": 1.0},
    {"rad_s3": 1.0},
    {"rad_s2_V": 1.0},
    {"counts": 1.0},
)
_UNITS = sorted({unit for family in _UNIT_FAMILIES for unit in family}, key=len, reverse=True)
_UNIT_SPELLINGS = {"rad_s2_V": "(rad/s2)/V", "hz": "Hz", "khz": "kHz"}
_BY_LOWER = {unit.lower(): unit for unit in _UNITS}


def split_unit(key: str) -> tuple[str, str]:
    """Split a key into stem and unit, however the unit is capitalised; empty if it ends in none known."""
    for unit in _UNITS:
        if key.lower().endswith(f"_{unit.lower()}") and len(key) > len(unit) + 1:
            return key[: -len(unit) - 1], unit
    return key, ""


def factor(unit: str, wanted: str) -> float | None:
    """Return what to multiply a value in `unit` with to have it in `wanted`; None if they do not compare."""
    for family in _UNIT_FAMILIES:
        if unit in family and wanted in family:
            return family[unit] / family[wanted]
    return None


def unit_named(text: str) -> str:
    """Return the unit that was written as text, such as "rad/s" or "kHz"; empty if none is known."""
    return _BY_LOWER.get(text.strip().replace("/", "_").lower(), "")


def in_words(unit: str) -> str:
    """Return the unit of a key in its usual spelling, such as rad/s."""
    return _UNIT_SPELLINGS.get(unit) or unit.replace("_", "/")
