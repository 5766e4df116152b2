"""Lists of observers to be compared: their names, and the table of each in a rig."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, cast

from dcmp_hil.config.formatting import printable
from dcmp_hil.config.gain_rules import observer_limits
from dcmp_hil.config.overrides import apply_overrides
from dcmp_hil.config.rig import KINDS
from dcmp_hil.config.sections import Custom
from dcmp_hil.config.suggestions import for_unknown_kind
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dcmp_hil.config.kinds import ObserverSection
    from dcmp_hil.config.rig import Rig
    from dcmp_hil.control.observers.settings import ObserverSettings

OPTION = "--compare"
_COMPARED_MAX, _NAME_CHARS_MAX = 8, 60  # observers; of a name, which a column has between quantity and unit
_CLASS = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
_OTHER_CHARACTERS = re.compile(r"[^a-z0-9]+")


def observer_kinds(texts: Iterable[str], option: str = OPTION) -> tuple[str, ...]:
    """Return the kinds that lists such as ``kalman,derivative`` name, in their order.

    Parameters
    ----------
    texts
        A list each, or one of them: kinds of `[observer]`, or `module:Class`.
    option
        What they were given by, for messages.

    Raises
    ------
    ConfigError
        If one is no kind, or is there twice; with every one that is.
    """
    texts = (texts,) if isinstance(texts, str) else texts
    kinds = [kind_named(part) for text in texts for part in text.split(",")]
    if len(kinds) > _COMPARED_MAX:  # alone: a sentence for each of a thousand would hide it
        raise ConfigError(
            f"{option}: {len(kinds)} observers at once; at most {_COMPARED_MAX}. Leave some out."
        )
    faults = [f'{option}: got "{printable(kind)}"; {_expected(kind)}' for kind in kinds if not is_kind(kind)]
    columns = [column_name(kind) for kind in kinds]
    twice = dict.fromkeys(kind for kind in kinds if is_kind(kind) and columns.count(column_name(kind)) > 1)
    faults += [f"{option}: {kind} is given twice. Leave one out." for kind in twice]
    faults += [
        f"{option}: {printable(kind)}: a name of more than {_NAME_CHARS_MAX} characters, which is that of a "
        "column, too. Import the class in a module of a shorter name."
        for kind in kinds
        if len(column_name(kind)) > _NAME_CHARS_MAX
    ]
    if faults:
        raise ConfigError(*faults)
    return tuple(kinds)


def _expected(kind: str) -> str:
    """Return what was expected in place of a word that is no kind."""
    if "=" in kind:
        return "expected a list of observers, such as kalman,derivative; KEY=VALUE is for `dcmp-hil replay`."
    return for_unknown_kind("observer", kind)


def kind_named(text: str) -> str:
    """Return an observer's kind as a rig spells it."""
    text = text.strip()
    return text if ":" in text else text.lower().replace("-", "_")


def is_kind(text: str) -> bool:
    """Return whether a text is a kind of `[observer]`, or `module:Class`."""
    return bool(_CLASS.fullmatch(text)) or (text != "custom" and text in KINDS["observer"])


def column_name(kind: str) -> str:
    """Return what columns call an observer: its kind, or module and class with all else as underscores."""
    if ":" not in kind:
        return kind
    return f"own_{_OTHER_CHARACTERS.sub('_', kind.lower()).strip('_')}"


def compared_sections(rig: Rig, kinds: Iterable[str], option: str = OPTION) -> dict[str, ObserverSection]:
    """Return the table of each observer that runs beside the loop of a rig, by its kind.

    The one that closes the loop is left out: it runs already. The others are as `--set observer.kind=...`
    makes them: keys that both kinds have keep what the rig says, all others go by their rules.

    Raises
    ------
    ConfigError
        If the rig is none for one of them; with every one that is.
    """
    found: dict[str, ObserverSection] = {}
    faults: list[str] = []
    for kind in observer_kinds(kinds, option):
        if kind == rig.observer.kind:
            continue
        table = rig.model_dump(include={"observer"}, exclude_unset=True)
        apply_overrides(table, [f"observer.kind={kind}"])
        if ":" in kind:
            found[kind] = Custom.model_validate(table["observer"])
            continue
        section = cast("ObserverSettings", KINDS["observer"][kind].model_validate(table["observer"]))
        if fault := section.fault(rig.observer_context, observer_limits(rig)):
            faults.append(f"{option} {kind}: {fault}")
        found[kind] = section
    if faults:
        raise ConfigError(*faults)
    return found
