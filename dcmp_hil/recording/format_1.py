"""Events of format 1, which had neither kind nor data: what programs need is found in their sentences.

Nothing else reads a sentence, and these sentences are written by no version any more.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from dcmp_hil.common.printable_text import readable
from dcmp_hil.config.toml_text import parse_value
from dcmp_hil.values import ChangeData, Event, EventKind, LinkData, PhaseData

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.values import Level

_APPLIED = re.compile(r"(.*), applied at t = [0-9.]+ s")
_ONE_CHANGE = re.compile(r"([a-z_]+\.\w+)(?:: .{0,200}? -> | = )(.{0,200}?)(?=, [a-z_]+\.\w+(?:: | = )|$)")
_LOWERING = "lowering the arm"
_LEVELS: Mapping[str, Level] = {"INFO": "INFO", "WARN": "WARN", "ERROR": "ERROR"}


def event_of_format_1(document: Mapping[str, Any]) -> Event:
    """Return the event in a JSON object of format 1.

    Raises
    ------
    ValueError
        If something is missing, or it is no event of that format.
    """
    try:
        t, name, text = float(document["t"]), document["name"], readable(str(document["message"]))
        if name == "PHASE":
            return Event(t, "INFO", EventKind.PHASE, text, PhaseData(text))
        if name == "LINK":
            return Event(t, "DEBUG", EventKind.LINK, text, LinkData(_counters(text)))
        level = _LEVELS[name]
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ValueError("an event that this version cannot read") from error
    if text == _LOWERING:
        return Event(t, level, EventKind.LOWERING, text)
    changed = _changed(text)
    if changed:
        return Event(t, level, EventKind.CHANGE, text, ChangeData(changed))
    return Event(t, level, EventKind.OTHER, text)


def _changed(text: str) -> dict[str, float | str]:
    """Return each key that a text says was changed, with its new value; nothing for other texts."""
    words = _APPLIED.fullmatch(text)
    return {key: parse_value(value) for key, value in _ONE_CHANGE.findall(words[1])} if words else {}


def _counters(text: str) -> dict[str, int]:
    """Return the counters in "lost=3 stale=0"."""
    return {name: int(count) for name, _, count in (pair.partition("=") for pair in text.split())}
