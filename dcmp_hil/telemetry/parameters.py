"""The parameters of a run as a table and as steps: what was tuned is seen where it acted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.live.change import found_in

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from dcmp_hil.values import Event

PATH, RELATIVE = "params", "params_over_start"
"""Entities: the table, with each number below it; all of them on one axis."""
_TUNED = ("controller.", "observer.", "reference.")


class Parameters:
    """What a run is tuned by, as far as its events tell.

    Parameters
    ----------
    rows
        Name and value, as the run begins.
    kinds
        What the keys of a section and kind are called.
    """

    def __init__(self, rows: Iterable[tuple[str, str]], kinds: Mapping[str, Iterable[str]]) -> None:
        self.rows = dict(rows)
        self._kinds = {kind: set(keys) for kind, keys in kinds.items()}
        numbers = {key: number(value) for key, value in self.rows.items() if key.startswith(_TUNED)}
        self._start = {key: value for key, value in numbers.items() if math.isfinite(value) and value}

    @property
    def drawn(self) -> tuple[str, ...]:
        """Those that can be drawn over what they were at the start: numbers, and not 0 then."""
        return tuple(self._start)

    @property
    def relative(self) -> list[float]:
        """Each of `drawn` over what it was at the start; NaN once it is gone."""
        return [number(self.rows.get(key, "")) / start for key, start in self._start.items()]

    def numbers(self) -> Iterator[tuple[str, float]]:
        """Yield what is tuned and a number."""
        for key, text in self.rows.items():
            value = number(text)
            if key.startswith(_TUNED) and math.isfinite(value):
                yield key, value

    def take(self, event: Event) -> dict[str, float] | None:
        """Take an event; return the numbers that it changed, None if it tells of no change."""
        changed = {key: value.strip('"') for key, value in found_in(event.text).items()}
        if not changed:
            return None
        self.rows |= changed
        for key in changed:
            if key.endswith(".kind"):
                self._keep_those_of(key)
        return {key: value for key, value in self.numbers() if key in changed}

    def _keep_those_of(self, kind: str) -> None:
        """Forget what the kind before had and the new one has not."""
        section, _, _ = kind.partition(".")
        known = self._kinds.get(f"{kind}={self.rows[kind]}", ())
        self.rows = {
            key: v for key, v in self.rows.items() if not key.startswith(f"{section}.") or key in known
        }


def line_of(key: str) -> str:
    """Return the entity of a number."""
    return f"{PATH}/{key.replace('.', '/')}"


def table_of(head: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of names and values, in Markdown."""
    return "\n".join([f"| {head} | |", "|:--|:--|", *(f"| {name} | {value} |" for name, value in rows)])


def number(text: str) -> float:
    """Return the number that a value begins with; NaN for none."""
    try:
        return float(text.partition(" ")[0])
    except ValueError:
        return math.nan
