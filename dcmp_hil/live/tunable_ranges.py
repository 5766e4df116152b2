"""Every settable key with its value, unit, allowed values and slider range."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Any

from dcmp_hil.config.rules import own_bounds, within_reason
from dcmp_hil.config.units import in_words, split_unit
from dcmp_hil.live.state import finite
from dcmp_hil.live.tunables import allowed, choices, settable, value_of

if TYPE_CHECKING:
    from dcmp_hil.common.section import Section
    from dcmp_hil.config import Rig

_SLIDER_RANGES = {  # from, to; both above 0: by decades. A key without a row: see `slider_range`
    "kp_1_s2": (100.0, 20_000.0),
    "kd_1_s": (10.0, 400.0),
    "L1_1_s": (0.5, 50.0),
    "L2_1_s2": (0.5, 500.0),
    "M_rad_s3": (1.0, 2000.0),
    "bandwidth_rad_s": (5.0, 200.0),
    "w_noise": (0.1, 1000.0),
    "d_noise": (0.001, 10.0),
    "edge_counts": (0.02, 1.0),
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
_SEARCH_HALVINGS, _RELATIVE_STEP = 12, 1e-3  # of the search; of a value, the nearest that is tried
_SLIDER_MAX = 1e9  # of a key without a bound
_ANGLE_RANGE_RAD = (-3.0, 3.0)
_USUAL_RATIO = 10.0  # between an end of a slider without a row and the value
_MU0_SLIDER_MIN_RAD_S = 5.0  # rad/s, of the slider for mu0


def tunable_descriptions(rig: Rig) -> list[dict[str, Any]]:
    """Return what JSON can hold, in the order in which it is best shown; a bound that is none is None."""
    return [_choice(rig, key) if key.endswith(".kind") else _number(rig, key) for key in settable(rig)]


def _choice(rig: Rig, key: str) -> dict[str, Any]:
    table = key.partition(".")[0]
    return {"key": key, "value": value_of(rig, key), "choices": choices(rig, table)}


def _number(rig: Rig, key: str) -> dict[str, Any]:
    section, _, name = key.partition(".")
    kind = type(getattr(rig, section))
    field = kind.model_fields[name]
    value = float(value_of(rig, key))
    low, high = within_reason(kind, name)
    start, end = slider_range(kind, name, value)
    if name == "mu0_rad_s":
        high = min(high, 0.3 / rig.period)
        start, end = _MU0_SLIDER_MIN_RAD_S, high
    low, high = _end(rig, key, value, low), _end(rig, key, value, high)
    start, end = max(start, low), min(end, high)
    return {
        "key": key,
        "value": value,
        "unit": in_words(split_unit(name)[1]),
        "meaning": (field.description or "").replace("\n", " "),
        "low": finite(low),
        "high": finite(high),
        "slider": [min(start, value) if value > 0.0 or start <= 0.0 else start, max(end, value)],
        "decades": start > 0.0 and math.isfinite(end),
    }


def slider_range(section: type[Section], name: str, value: float) -> tuple[float, float]:
    """Return where the slider of a key starts and ends, before the limits of the rig.

    Without a row in the table it goes as far as the key's own bounds; an angle without bounds goes +-3 rad,
    and any other key a factor 10 to either side of its value.
    """
    if name in _SLIDER_RANGES:
        return _SLIDER_RANGES[name]
    own = own_bounds(section, name)
    if math.isfinite(own.low) and math.isfinite(own.high):
        return own.low, own.high
    stem, unit = split_unit(name)
    if unit == "rad" and not split_unit(stem)[1] and not math.isfinite(own.low):  # and not V/rad
        return _ANGLE_RANGE_RAD
    far = min(_USUAL_RATIO * abs(value), sys.float_info.max) or 1.0
    if own.low < 0.0:
        return -far, far
    return (value / _USUAL_RATIO if own.low_excluded else own.low), far


def _end(rig: Rig, key: str, value: float, bound: float) -> float:
    """Return how far a number may go from its value towards a bound: as far as a change would be taken."""
    far = min(max(bound, -_SLIDER_MAX), _SLIDER_MAX)
    if allowed(rig, key, far):
        return bound
    way = math.copysign(1.0, far - value)
    near = _RELATIVE_STEP * max(abs(value), 1.0)
    if abs(far - value) <= near or not allowed(rig, key, value + way * near):
        return value
    inside, outside = math.log(near), math.log(abs(far - value))
    for _ in range(_SEARCH_HALVINGS):
        middle = 0.5 * (inside + outside)
        fits = allowed(rig, key, value + way * math.exp(middle))
        inside, outside = (middle, outside) if fits else (inside, middle)
    return _rounded(value + way * math.exp(inside), value)


def _rounded(end: float, value: float) -> float:
    """Round to three digits towards the value: what the panel shows is what it takes."""
    digit = 10.0 ** (math.floor(math.log10(abs(end))) - 2) if end else 1.0
    rounded = float(f"{(math.floor if end > value else math.ceil)(end / digit) * digit:.12g}")
    return rounded if (rounded - value) * (end - value) > 0.0 else end
