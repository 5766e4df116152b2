"""The parameters of a run as a table and as steps: what was tuned is seen where it acted."""

from __future__ import annotations

import math
from itertools import chain
from typing import TYPE_CHECKING

from dcmp_hil.config.formatting import toml_value
from dcmp_hil.telemetry.rerun.font_text import markdown
from dcmp_hil.values import ChangeData

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from dcmp_hil.values import Event

PATH, RELATIVE = "params", "params_over_start"
"""Entities: the table, with each number below it; all of them on one axis."""
_TUNED_KEYS = ("controller.", "observer.", "reference.")


class Parameters:
    """Tunable values of a run, as known from its events.

    Parameters
    ----------
    rows
        Name and value, as the run begins.
    kinds
        What the keys of a section and kind are called.
    numbers
        Of the rows, those that are numbers, as the run begins.
    """

    def __init__(
        self,
        rows: Iterable[tuple[str, str]],
        kinds: Mapping[str, Iterable[str]],
        numbers: Mapping[str, float],
    ) -> None:
        self.rows = dict(rows)
        self._kinds = {kind: set(keys) for kind, keys in kinds.items()}
        self._numbers = dict(numbers)
        self._start = {key: value for key, value in self.numbers() if value}

    @property
    def drawn(self) -> tuple[str, ...]:
        """Names of the values that can be drawn relative to the start: numbers that were not 0 then."""
        return tuple(self._start)

    @property
    def relative(self) -> list[float]:
        """Each of `drawn` over what it was at the start; NaN once it is gone."""
        return [self._numbers.get(key, math.nan) / start for key, start in self._start.items()]

    def numbers(self) -> Iterator[tuple[str, float]]:
        """Yield the name and value of each tunable number."""
        for key, value in self._numbers.items():
            if key.startswith(_TUNED_KEYS) and math.isfinite(value):
                yield key, value

    def take(self, event: Event) -> dict[str, float] | None:
        """Process an event; return the numbers that it changed, None if it is no change."""
        if not isinstance(event.data, ChangeData):
            return None
        changed = event.data.values
        for key, value in changed.items():
            self.rows[key] = value if isinstance(value, str) else toml_value(value)
            self._numbers[key] = math.nan if isinstance(value, str) else value
        for key in changed:
            if key.endswith(".kind"):
                self._keep_those_of(key)
        return {key: value for key, value in self.numbers() if key in changed}

    def _keep_those_of(self, kind: str) -> None:
        """Forget what the kind before had and the new one has not."""
        section, _, _ = kind.partition(".")
        known = self._kinds.get(f"{kind}={self.rows[kind]}", ())
        for key in [key for key in self.rows if key.startswith(f"{section}.") and key not in known]:
            del self.rows[key]
            self._numbers.pop(key, None)


def line_of(key: str) -> str:
    """Return the entity of a number."""
    return f"{PATH}/{key.replace('.', '/')}"


def page_of(head: str, rows: Mapping[str, str]) -> str:
    """Return parameters as a table with a heading for each section, so that keys are short, in Markdown."""
    sections: dict[str, list[tuple[str, str]]] = {}
    for key, value in rows.items():
        section, _, name = key.rpartition(".")
        title = (f"**{markdown(section)}**", "")
        sections.setdefault(section, [title]).append((markdown(name), markdown(value)))
    return _table(head, chain.from_iterable(sections.values()))


def table_of(head: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of names and values, in Markdown."""
    return _table(head, ((markdown(name), markdown(value)) for name, value in rows))


def _table(head: str, cells: Iterable[tuple[str, str]]) -> str:
    rows = (f"| {name} | {value} |" for name, value in cells)
    return "\n".join([f"| {markdown(head)} | |", "|:--|:--|", *rows])
