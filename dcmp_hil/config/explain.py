"""Values of a rig, key by key, and warnings of settings that are legal but questionable."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.config.formatting import toml_value
from dcmp_hil.config.reference_reach import beyond_reach
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.suggestions import kinds_in_words
from dcmp_hil.control.controllers.settings import ControllerSettings
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.safety.polarity_check import probe_for

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic import BaseModel

    from dcmp_hil.config.rig import Rig


def explain(rig: Rig) -> list[tuple[str, str, str]]:
    """List every key of a rig: dotted key, value, meaning."""
    return _rows(rig, "", rig)


def _rows(section: BaseModel, prefix: str, rig: Rig) -> list[tuple[str, str, str]]:
    rows: list[tuple[str, str, str]] = []
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if hasattr(value, "model_fields_set"):
            if prefix or name != "sim" or rig.backend.simulated:
                rows += _rows(value, f"{prefix}{name}.", rig)
            continue
        if prefix == "sim.plant." and name not in section.model_fields_set:
            continue  # as in [model]
        meaning = (field.description or _kinds(prefix, name)).replace("\n", " ")
        if isinstance(value, dict):
            rows += [(f"{prefix}{name}.{option}", toml_value(of), meaning) for option, of in value.items()]
            continue
        shown = _by_rule(section, name, rig) if value is None else toml_value(value)
        rows.append((f"{prefix}{name}", shown, meaning))
    return rows


def _kinds(prefix: str, name: str) -> str:
    """Return the other kinds of a table."""
    section = prefix.removesuffix(".")
    return f"Kind: {kinds_in_words(section)}." if name == "kind" and section in KINDS else ""


def numbers(rig: Rig) -> dict[str, float]:
    """Return every number of a rig by its dotted key, those by rule worked out."""
    return dict(_numbers(rig, "", rig))


def _numbers(section: BaseModel, prefix: str, rig: Rig) -> Iterator[tuple[str, float]]:
    for name in type(section).model_fields:
        value = getattr(section, name)
        if hasattr(value, "model_fields_set"):
            yield from _numbers(value, f"{prefix}{name}.", rig)
        value = by_rule(section, name, rig) if value is None else value
        if isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{prefix}{name}", float(value)


def by_rule(section: BaseModel, name: str, rig: Rig) -> float | None:
    """Return what the rule makes of a key that was left out; None where there is no rule."""
    return section.by_rule(name, rig.observer_context) if isinstance(section, ObserverSettings) else None


def _by_rule(section: BaseModel, name: str, rig: Rig) -> str:
    value = by_rule(section, name, rig)
    return "none" if value is None else f"{value:.4g} (by rule)"


def warnings(rig: Rig) -> list[str]:
    """Return warnings of settings that are valid and rarely intended."""
    rules = (_observer, _controller, _monitors, _immediate, _probe, _soft_start, _signs)
    return [sentence for rule in rules if (sentence := rule(rig))] + beyond_reach(rig)


def _observer(rig: Rig) -> str:
    if isinstance(rig.observer, ObserverSettings):
        return rig.observer.warning(rig.observer_context)
    return ""


def _controller(rig: Rig) -> str:
    return rig.controller.warning() if isinstance(rig.controller, ControllerSettings) else ""


def _monitors(rig: Rig) -> str:
    if rig.supervisor.monitors == "all" or _is_ideal(rig):
        return ""
    return 'supervisor.monitors = "finite": a runaway is not stopped; "all" is what a real rig has.'


def _immediate(rig: Rig) -> str:
    if rig.supervisor.start == "engage" or _is_ideal(rig):
        return ""
    return 'supervisor.start = "immediate": no settling and no ramp; "engage" is what a real rig has.'


def _probe(rig: Rig) -> str:
    if rig.supervisor.probe == "first" and rig.supervisor.start == "engage":
        return _coarse(rig)
    if rig.supervisor.probe == "first" or rig.backend.simulated:
        return ""
    return 'supervisor.probe = "off": a motor or encoder wired the wrong way is found by running away.'


def _coarse(rig: Rig) -> str:
    if probe_for(rig.model.values(), rig.amplifier.limit, rig.encoder.count) is not None:
        return ""
    return (
        f"encoder.counts_per_rev = {rig.encoder.counts:g}: too coarse for the probe before the start; a "
        "motor or encoder wired the wrong way is found by running away, in up to 0.35 s."
    )


def _is_ideal(rig: Rig) -> bool:
    """Recognise the paper's simulation, where nothing is between the loop and the plant."""
    return rig.encoder.counts is None and math.isinf(rig.amplifier.limit)


def _signs(rig: Rig) -> str:
    """Return a warning of a sign that has no effect in a simulated rig."""
    turned = [
        (f"{key}.sign", fault)
        for key, section, fault in (
            ("amplifier", rig.amplifier, "plant.motor_sign"),
            ("encoder", rig.encoder, "plant.enc_sign"),
        )
        if section.sign == -1
    ]
    if not turned or not rig.backend.simulated:
        return ""
    keys, faults = zip(*turned, strict=True)
    return (
        f"{' and '.join(keys)} = -1: a simulated rig is wired as its file says, and the loop sees no "
        f"difference. What a wrong sign does is shown by --fault {' or '.join(faults)}."
    )


def _soft_start(rig: Rig) -> str:
    if rig.supervisor.start == "engage" and rig.reference.soft_start_s == 0.0:
        return "reference.soft_start_s = 0: the first command is as large as the first error asks for."
    return ""
