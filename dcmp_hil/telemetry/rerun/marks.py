"""Vertical marks in every plot at the instants of a trip, a warning and a change."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.telemetry.rerun.rails import WINDOW_S
from dcmp_hil.values import EndData, EventKind, PhaseData

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.values import Event

_REPEAT_TIME_MIN_S = 0.5  # s between two marks of a kind: a limit that chatters is one mark
_FORCED_ENDS = {EventKind.TRIP, EventKind.DEADLINE}


class MarkStyle(NamedTuple):
    """Colour and width of a kind of mark."""

    colour: tuple[int, int, int]
    width: float  # points


MARKS = {
    "change": MarkStyle((140, 205, 230), 1.5),
    "trip": MarkStyle((255, 40, 40), 3.0),
    "warning": MarkStyle((255, 176, 0), 1.5),
}
"""Kinds of marks, as the legend names them."""


def is_trip(event: Event) -> bool:
    """Return whether the run ended by force at this event."""
    tripped = isinstance(event.data, PhaseData) and event.data.phase == "tripped"
    failed = isinstance(event.data, EndData) or (event.kind is EventKind.END and event.level == "ERROR")
    return tripped or failed or event.kind in _FORCED_ENDS


def mark_of(event: Event) -> str | None:
    """Return the kind of mark that an event has; None for none."""
    if is_trip(event):
        return "trip"
    if event.kind is EventKind.CHANGE:
        return "change"
    return "warning" if event.level in {"WARN", "ERROR"} else None


@dataclass(slots=True)
class _Mark:
    kind: str
    t: float  # s
    drawn: dict[str, float] = field(default_factory=dict)  # plot to half the height of the drawn line


class Marks:
    """The marks that a plot can still show, and how high each is drawn."""

    def __init__(self) -> None:
        self._marks: list[_Mark] = []

    def __len__(self) -> int:
        """Count them."""
        return len(self._marks)

    def add(self, kind: str, t: float) -> None:
        """Add a mark of a kind at `t`, s, unless there is one just before it."""
        if not any(mark.kind == kind and abs(t - mark.t) < _REPEAT_TIME_MIN_S for mark in self._marks):
            self._marks.append(_Mark(kind, t))

    def forget(self, t: float) -> None:
        """Forget what no plot shows any more whose data begin at `t`, s."""
        self._marks = [mark for mark in self._marks if mark.t > t - WINDOW_S]

    def due(self, plot: str, now: float, reach: float) -> Iterator[tuple[str, float, float]]:
        """Yield kind, time, s, and half the height of each mark that is new in a plot, or too low.

        Parameters
        ----------
        plot
            Its entity.
        now
            Time of the newest data, s; later marks wait, since the axis at their time is not known.
        reach
            End of the plot's axis.
        """
        reach = max([reach, *(mark.drawn.get(plot, 0.0) for mark in self._marks)])  # they hold the axis, too
        for mark in self._marks:
            if mark.t <= now and mark.drawn.get(plot, 0.0) < reach:
                mark.drawn[plot] = reach
                yield mark.kind, mark.t, reach
