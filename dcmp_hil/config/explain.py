"""What a rig comes to, key by key, and what in it is legal but questionable."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.config.messages import toml_value
from dcmp_hil.controllers.pd_compensated import PdSettings
from dcmp_hil.observers.paper import PaperSettings
from dcmp_hil.observers.super_twisting import SuperTwistingSettings, bandwidth_floor, slope_bound
from dcmp_hil.references.periodic import Chirp, Sine

if TYPE_CHECKING:
    from pydantic import BaseModel

    from dcmp_hil.config.rig import Rig

_LEAST_DAMPING = 0.5
_FAR_FROM_RULE = 3.0


def explain(rig: Rig) -> list[tuple[str, str, str]]:
    """List every key of a rig: dotted key, value, meaning."""
    return _rows(rig, "", rig)


def _rows(section: BaseModel, prefix: str, rig: Rig) -> list[tuple[str, str, str]]:
    rows: list[tuple[str, str, str]] = []
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if hasattr(value, "model_fields_set"):
            if prefix or name != "sim" or rig.backend.kind == "sim":
                rows += _rows(value, f"{prefix}{name}.", rig)
            continue
        if prefix == "sim.plant." and name not in section.model_fields_set:
            continue  # as in [model]
        shown = _by_rule(name, rig) if value is None else toml_value(value)
        rows.append((f"{prefix}{name}", shown, (field.description or "").replace("\n", " ")))
    return rows


def _by_rule(name: str, rig: Rig) -> str:
    """Show what the rule makes of a key that was left out."""
    if name == "mu0_rad_s":
        return f"{bandwidth_floor(rig.encoder.counts, rig.period):.4g} (by rule)"
    if name == "M_rad_s3":
        return f"{slope_bound(rig.encoder.counts):g} (by rule)"
    return "none"


def warnings(rig: Rig) -> list[str]:
    """Name what is allowed and yet seldom meant."""
    found = [_observer(rig), _damping(rig), _start(rig), _reach(rig)]
    return [sentence for sentence in found if sentence]


def _observer(rig: Rig) -> str:
    observer, counts = rig.observer, rig.encoder.counts
    if isinstance(observer, PaperSettings) and counts is not None:
        return (
            f"observer: the paper's Euler observer on an encoder of {counts:g} counts costs ten times the "
            'voltage variation; kind = "super_twisting" is made for it.'
        )
    if isinstance(observer, SuperTwistingSettings) and observer.mu0_rad_s is not None:
        usual = bandwidth_floor(counts, rig.period)
        if observer.mu0_rad_s == 0.0:
            return "observer.mu0_rad_s = 0: without its floor the loop runs away on a motor 25 % too strong."
        if not usual / _FAR_FROM_RULE <= observer.mu0_rad_s <= usual * _FAR_FROM_RULE:
            return f"observer.mu0_rad_s = {observer.mu0_rad_s:g} is far from the rule's {usual:.3g} rad/s."
    return ""


def _damping(rig: Rig) -> str:
    if not isinstance(rig.controller, PdSettings) or rig.controller.kp_1_s2 == 0.0:
        return ""
    zeta = rig.controller.kd_1_s / (2.0 * math.sqrt(rig.controller.kp_1_s2))
    if zeta >= _LEAST_DAMPING:
        return ""
    return f"controller: damping kd/(2 sqrt kp) = {zeta:.2f} will ring; kd = 2 sqrt kp gives 1."


def _start(rig: Rig) -> str:
    if rig.supervisor.start == "engage" and rig.reference.soft_start_s == 0.0:
        return "reference.soft_start_s = 0: the first command is as large as the first error asks for."
    return ""


def _reach(rig: Rig) -> str:
    reference, limit = rig.reference, rig.supervisor.position_limit_rad
    if isinstance(reference, Sine | Chirp) and abs(reference.offset_rad) + reference.amplitude_rad > limit:
        return f"reference: it leaves supervisor.position_limit_rad = {limit:g} and will trip."
    return ""
