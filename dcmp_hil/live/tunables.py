"""Keys that may change in a run: gains and reference, checked by the rules of rig.toml; never a limit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.config import change_rig
from dcmp_hil.config.explain import by_rule, warnings
from dcmp_hil.config.formatting import toml_value
from dcmp_hil.config.gain_rules import holds
from dcmp_hil.config.reference_reach import beyond_reach
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.sections import Custom
from dcmp_hil.config.variation import expected_variation
from dcmp_hil.control.change import Change
from dcmp_hil.control.controllers.settings import ControllerSettings
from dcmp_hil.control.observers.settings import ObserverSettings
from dcmp_hil.control.references import ReferenceSettings
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from dcmp_hil.config import Rig

_TUNABLE_TABLES = ("controller", "observer", "reference")


def settable(rig: Rig) -> list[str]:
    """List the dotted keys that may change while this rig runs."""
    sections = {table: getattr(rig, table) for table in _TUNABLE_TABLES}
    return [
        f"{table}.{key}"
        for table, section in sections.items()
        if not isinstance(section, Custom)
        for key in section.tunable()
    ]


def choices(rig: Rig, table: str) -> list[str]:
    """Return the kinds to which a run can change: any reference, and kinds of the same class."""
    now = type(getattr(rig, table))
    return [
        kind
        for kind, settings in KINDS[table].items()
        if settings is now or (issubclass(settings, ReferenceSettings) and settings.in_run)
    ]


def value_of(rig: Rig, key: str) -> Any:
    """Return what a settable key is; what the rig leaves to a rule is worked out."""
    table, name = key.split(".")
    section = getattr(rig, table)
    value = getattr(section, name)
    return by_rule(section, name, rig) if value is None else value


def changed(rig: Rig, overrides: Sequence[str], *, repeated: bool = False) -> tuple[Rig, Change]:
    """Check overrides of a running rig; return the new rig and the change to apply.

    Parameters
    ----------
    rig
        As it runs.
    overrides
        `key=value` in dotted form.
    repeated
        Whether a replay repeats the change. Its references are the recorded ones, so that none is beyond
        reach; and it judges no variation of the voltage. To work out what variation is expected evaluates
        the reference, and so reads the file of one: a replay must not read what a recording names.

    Returns
    -------
    tuple
        The rig as it runs after the change, and what the loop is sent.

    Raises
    ------
    ConfigError
        With every fault found: those of rig.toml, and keys that cannot change in a run.
    """
    if not overrides:
        raise ConfigError("Nothing to change. Write KEY=VALUE, such as controller.kp_1_s2=5200.")
    keys = [override.partition("=")[0].strip() for override in overrides]
    _refuse(rig, [key for key in keys if _known(rig, key) and key not in settable(rig)])
    after = change_rig(rig, overrides)
    if not after.reference.in_run and after.reference != rig.reference:
        kind = after.reference.kind
        raise ConfigError(
            f'reference.kind: "{kind}" is read before a run, not in one. Start another run with it.'
        )
    _refuse(after, [key for key in keys if key not in settable(after)])
    if type(after.controller) is not type(rig.controller) or type(after.observer) is not type(rig.observer):
        raise ConfigError(
            "Another class, or one of your own, takes the place of no other in a run. "
            "Start another run with it."
        )
    if not repeated and after.reference != rig.reference and (faults := beyond_reach(after)):
        raise ConfigError(*faults)
    return after, _worked_out(rig, after, variation=not repeated)


def doubts(before: Rig, after: Rig) -> list[str]:
    """Return the warnings that a change causes, in the words of `run`."""
    known = warnings(before)
    return [sentence for sentence in warnings(after) if sentence not in known]


def allowed(rig: Rig, key: str, value: float) -> bool:
    """Return whether `changed` would take a number of a key, its bounds by the schema aside."""
    table, name = key.split(".")
    section = getattr(rig, table)
    after = rig.model_copy(update={table: section.model_copy(update={name: value})})
    if table == "reference":
        return not beyond_reach(after)
    return holds(after)


def _refuse(rig: Rig, keys: list[str]) -> None:
    if keys:
        raise ConfigError(
            *(f"{key} cannot be changed in a run{_why(rig, key)}." for key in keys),
            f"These can: {', '.join(settable(rig))}.",
        )


def _why(rig: Rig, key: str) -> str:
    table, _, name = key.partition(".")
    section = getattr(rig, table, None)
    if isinstance(section, Custom):
        return f": {section.kind} is a class of your own"
    if isinstance(section, ObserverSettings) and name in section.at_start():
        return ": it acts at the next start"
    return ""


def _known(rig: Rig, key: str) -> bool:
    """Whether it is a key of this rig, or a table."""
    inner: Any = rig
    for part in key.split("."):
        if part not in getattr(type(inner), "model_fields", {}):
            return False
        inner = getattr(inner, part)
    return True


def _worked_out(before: Rig, after: Rig, *, variation: bool) -> Change:
    gains = tuning = None
    if isinstance(after.controller, ControllerSettings) and after.controller != before.controller:
        gains = after.controller.gains
    if isinstance(after.observer, ObserverSettings) and after.observer != before.observer:
        tuning = after.observer.tuning(after.observer_context)
    reference = after.reference.source() if after.reference != before.reference else None
    values = _different(before, after)
    words = _in_words(before, values)
    expected = expected_variation(after) if variation else None
    return Change(words, values, gains, tuning, reference, expected)


def _different(before: Rig, after: Rig) -> dict[str, float | str]:
    """Return the new value of every key that is different."""
    old = {key: value_of(before, key) for key in settable(before)}
    new = {key: value_of(after, key) for key in settable(after)}
    return {key: value for key, value in new.items() if old.get(key) != value}


def _in_words(before: Rig, values: Mapping[str, float | str]) -> str:
    """Return the differences in words: "controller.kp_1_s2: 4000 -> 5200"."""
    known = settable(before)
    said = [
        f"{key}: {_shown(value_of(before, key))} -> {_shown(value)}"
        if key in known
        else f"{key} = {_shown(value)}"
        for key, value in values.items()
    ]
    return ", ".join(said) or "nothing is different"


def _shown(value: Any) -> str:
    if not isinstance(value, float):
        return toml_value(value)
    short = f"{value:.6g}"
    return short if float(short) == value else repr(value)
