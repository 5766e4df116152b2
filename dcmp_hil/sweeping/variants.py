"""Rigs of a sweep: one base with overrides for each run, by the rules of `load_rig`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from dcmp_hil.config.gain_rules import gains_hold
from dcmp_hil.config.load import change_rig
from dcmp_hil.config.many_gains import gain_faults
from dcmp_hil.config.overrides import apply_values
from dcmp_hil.config.rig import RULES_CONTEXT, Rig
from dcmp_hil.config.rules import RULES
from dcmp_hil.errors import ConfigError
from dcmp_hil.sweeping.design import override

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from dcmp_hil.sweeping.spec import Scalar

_OTHER_RULES = {RULES_CONTEXT: tuple(rule for rule in RULES if rule is not gains_hold)}
_RIGS_AT_ONCE = 512  # whose gains are looked at: some megabytes


class Refusal(str):
    """A sentence: why there is no rig with these values."""

    __slots__ = ()


def variants(base: Rig, runs: Iterable[Mapping[str, Scalar]]) -> list[Rig | Refusal]:
    """Return for each list of keys with values what `change_rig` makes of it, or the words of its error."""
    table = base.model_dump(exclude_unset=True)
    found: list[Rig | Refusal] = []
    waiting: list[tuple[int, Rig]] = []
    for number, values in enumerate(runs):
        made = _variant(base, _copied(table), values)
        found.append(made)
        if isinstance(made, Rig):
            waiting.append((number, made))
        if len(waiting) == _RIGS_AT_ONCE:
            _judge(waiting, found)
    _judge(waiting, found)
    return found


def _variant(base: Rig, table: dict[str, Any], values: Mapping[str, Scalar]) -> Rig | Refusal:
    """Return a rig that every rule but that of gains has passed."""
    try:
        apply_values(table, {tuple(key.split(".")): value for key, value in values.items()})
        return Rig.model_validate(table, context=_OTHER_RULES).in_folder(base.folder)
    except (ConfigError, ValidationError, ArithmeticError):
        return _in_words(base, values)


def _judge(waiting: list[tuple[int, Rig]], found: list[Rig | Refusal]) -> None:
    """Put a refusal in place of each rig whose gains do not hold."""
    faults = gain_faults([rig for _, rig in waiting])
    for (number, _), fault in zip(waiting, faults, strict=True):
        if fault:
            found[number] = Refusal(fault)
    waiting.clear()


def _in_words(base: Rig, values: Mapping[str, Scalar]) -> Refusal:
    """Return the words of `load_rig` for what is wrong; they take milliseconds to find."""
    try:
        change_rig(base, [override(*one) for one in values.items()])
    except ConfigError as error:
        return Refusal(" ".join(fault.removeprefix("--set ") for fault in error.faults))
    raise AssertionError("a rig that is right was refused")


def _copied(table: Mapping[str, Any]) -> dict[str, Any]:
    """Copy the tables inside, whose keys will be changed; lists are never changed."""
    return {key: _copied(value) if isinstance(value, dict) else value for key, value in table.items()}
