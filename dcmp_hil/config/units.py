"""Units at the end of a key: recognising the right quantity in the wrong one."""

from __future__ import annotations

_FAMILIES: tuple[dict[str, float], ...] = (
    {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3},
    {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    {"hz": 1.0, "khz": 1e3, "Hz": 1.0, "kHz": 1e3},
    {"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295},
    {"rad_s": 1.0, "deg_s": 0.017453292519943295, "rpm": 0.10471975511965977},
    {"V_s": 1.0, "mV_s": 1e-3, "V_ms": 1e3},
)


def split_unit(key: str) -> tuple[str, str]:
    """Split a key into stem and unit; the unit is empty if it ends in none that is known."""
    units = sorted((unit for family in _FAMILIES for unit in family), key=len, reverse=True)
    for unit in units:
        if key.endswith(f"_{unit}") and len(key) > len(unit) + 1:
            return key[: -len(unit) - 1], unit
    return key, ""


def factor(unit: str, wanted: str) -> float | None:
    """Return what to multiply a value in `unit` with to have it in `wanted`; None if they do not compare."""
    for family in _FAMILIES:
        if unit in family and wanted in family:
            return family[unit] / family[wanted]
    return None
