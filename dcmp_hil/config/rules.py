"""Rules that span more than one table of rig.toml, or belong to no single key."""

from __future__ import annotations

import math
from difflib import get_close_matches
from typing import TYPE_CHECKING

from dcmp_hil.backends.kinds import KINDS as BACKENDS
from dcmp_hil.config.units import in_words, split_unit
from dcmp_hil.config.words import number, toml_value
from dcmp_hil.observers.super_twisting import bandwidth_floor

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.config.rig import Rig
    from dcmp_hil.section import Section

_LEAST = 1e-6  # of any key that must be above 0
_REASON = {  # by unit: the largest that anybody may mean
    "1_s": 1e5,
    "1_s2": 1e9,
    "rad_s3": 1e7,
    "rad_s2": 1e6,
    "rad_s": 1e4,
    "rad": 1e4,
    "hz": 1e4,
    "s": 1e6,
}


def _step_divides_period(rig: Rig) -> str:
    if rig.sim.step_us == "auto":
        return ""
    steps = rig.period / (rig.sim.step_us * 1e-6)
    if steps >= 1 - 1e-9 and abs(steps - round(steps)) < 1e-6 * steps:
        return ""
    fits = rig.period * 1e6 / max(1, math.ceil(steps - 1e-9))
    return (
        f"sim.step_us: got {rig.sim.step_us:g} us, which does not divide the period of "
        f"{rig.period * 1e6:g} us "
        f'(loop.rate_hz = {rig.loop.rate_hz:g}). {fits:g} us would, or write "auto".'
    )


def _floor_below_rate(rig: Rig) -> str:
    mu0 = getattr(rig.observer, "mu0_rad_s", None)
    if mu0 is None or mu0 * rig.period <= 0.3 + 1e-9:
        return ""
    usual = bandwidth_floor(rig.encoder.counts, rig.period)
    return (
        f"observer.mu0_rad_s: got {mu0:g} rad/s, too fast for loop.rate_hz = {rig.loop.rate_hz:g}: "
        f"at most {0.3 / rig.period:g} rad/s. Leave the key out to get {usual:.3g} rad/s, or raise the rate."
    )


def _simulation_only(rig: Rig) -> str:
    if rig.backend.kind == "sim" or rig.backend.kind not in BACKENDS or not rig.simulation_only:
        return ""  # a module:Factory says for itself whether it is a simulation, when it is opened
    return (
        f'backend.kind: got "{rig.backend.kind}", but {", ".join(rig.simulation_only)} is for simulation '
        'only. Set backend.kind = "sim", or start from the rig bench-1khz.'
    )


def _known_backend(rig: Rig) -> str:
    kind = rig.backend.kind
    if ":" in kind or kind in BACKENDS:
        return ""
    close = get_close_matches(kind, list(BACKENDS), n=1)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    known = ", ".join(toml_value(name) for name in BACKENDS)
    return f'backend.kind: got {toml_value(kind)}; expected {known}, or "module:Factory" of your own.{hint}'


def _within_reason(rig: Rig) -> str:
    """Refuse what only a wrong unit explains, in the tables that do not say how large their keys may be."""
    sections: dict[str, Section] = {
        "observer": rig.observer,
        "controller": rig.controller,
        "reference": rig.reference,
    }
    return "\n".join(
        fault for name, section in sections.items() for fault in _beyond_reason(name, section) if fault
    )


def _beyond_reason(name: str, section: Section) -> Iterator[str]:
    for key, field in type(section).model_fields.items():
        value, unit = getattr(section, key), split_unit(key)[1]
        if not isinstance(value, float) or unit not in _REASON:
            continue
        above_zero = any(getattr(bound, "gt", None) == 0 for bound in field.metadata)
        low, high = (_LEAST if above_zero else -_REASON[unit]), _REASON[unit]
        if low <= value <= high:
            continue
        at_least, at_most = f"at least {number(low)}", f"at most {number(high)}"
        bounds = f"{at_least} and {at_most}" if above_zero else at_most if value > high else at_least
        yield (
            f"{name}.{key}: got {number(value)}; expected a number in {in_words(unit)}, {bounds}. "
            f"{field.description}"
        )


RULES: tuple[Callable[[Rig], str], ...] = (
    _within_reason,
    _known_backend,
    _step_divides_period,
    _floor_below_rate,
    _simulation_only,
)
"""Each returns its faults, one a line, beginning with the key; empty if there is none."""
