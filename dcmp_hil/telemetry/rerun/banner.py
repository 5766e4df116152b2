"""The banner: what the run does, what was changed last, what went wrong, in words and as a lamp."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.telemetry.rerun.font_text import markdown
from dcmp_hil.telemetry.rerun.marks import is_trip
from dcmp_hil.values import CauseData, ChangeData, EndData, EventKind, PhaseData

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.values import Event

PATH, LAMP, LAST = "banner", "lamp", "events/last"
GREY, GREEN, AMBER, RED = (90, 94, 100), (40, 150, 70), (235, 160, 20), (190, 30, 30)
_WARNING_TIME_S, _WARNING_TEXT_TIME_S = 10.0, 30.0  # s for which a warning has the lamp, and its words
_CHANGE_CHARS_MAX, _WARNING_CHARS_MAX = 56, 76
"""Characters: with the phase 150, which a screen of 1366 has in a line; the banner has room for one."""
_LAST_COUNT = 12  # events
_DRIVEN = {"engaging", "running"}
_OF_THE_START = {EventKind.HOST, EventKind.GRANT}  # what is as wanted there is in the log alone
_LEVELS = {"WARN": "▲ ", "ERROR": "■ "}


class Banner:
    """Follows the events of a run.

    Attributes
    ----------
    tripped
        Whether the run ended by force.
    """

    def __init__(self) -> None:
        self.tripped = False
        self._phase = "arming"
        self._change = self._warning = self._end = ""
        self._head, self._cause, self._text = "ENDED BY A FAULT", "", ""  # of a trip
        self._tripped = 0.0  # s, time of the trip
        self._warned = -_WARNING_TIME_S  # time, s
        self._last: list[str] = []

    def take(self, event: Event, before: Mapping[str, str], after: Mapping[str, str]) -> None:
        """Take an event.

        Parameters
        ----------
        event
            Any but counters.
        before, after
            Values of the parameters by key, before and after the event.
        """
        if isinstance(event.data, PhaseData):
            self._phase = event.data.phase
        elif isinstance(event.data, ChangeData):
            self._change = _in_words(event, event.data, before, after)
        elif event.level in _LEVELS and not is_trip(event):
            self._warned, self._warning = event.t, f"{event.t:.3f} s: {event.text}"
        if event.kind is EventKind.END:
            self._phase, self._end = "ended", event.text
        if is_trip(event):
            self._take_trip(event)
        if isinstance(event.data, PhaseData) or (event.kind in _OF_THE_START and event.level not in _LEVELS):
            return
        self._last.insert(0, f"{_LEVELS.get(event.level, '')}**{event.t:.3f} s** {markdown(event.text)}")
        del self._last[_LAST_COUNT:]

    def _take_trip(self, event: Event) -> None:
        """Take the first cause; its time is that of the phase, which comes before."""
        self._tripped = self._tripped if self.tripped else event.t
        self.tripped = True
        if isinstance(event.data, PhaseData) or self._text:
            return
        said = self._text = event.text
        if isinstance(event.data, CauseData):
            self._cause, self._head = event.data.cause, f"TRIPPED: {event.data.cause},"
        elif isinstance(event.data, EndData):
            self._head = f"ENDED BY A FAULT: {event.data.cause},"
            self._text = f"{event.data.words.rstrip().rstrip('.')}. {said[:1].upper()}{said[1:]}."

    def colour(self, t: float) -> tuple[int, int, int]:
        """Return the colour of the lamp at `t`, s."""
        if self.tripped:
            return RED
        if t - self._warned < _WARNING_TIME_S:
            return AMBER
        return GREEN if self._phase in _DRIVEN else GREY

    def text(self, t: float) -> str:
        """Return the banner as of `t`, s, in Markdown; one line while there was no trip."""
        if self.tripped:
            head = f"# {markdown(self._head)} at {self._tripped:.3f} s"
            return f"{head}\n\n{emphasised(self._text, self._cause)}".rstrip()
        warned = self._warning and t - self._warned < _WARNING_TEXT_TIME_S
        parts = [
            f"**{self._phase.upper()}**",
            markdown(self._end),
            markdown(_cut(self._change, _CHANGE_CHARS_MAX)),
            f"▲ {markdown(_cut(self._warning, _WARNING_CHARS_MAX))}" if warned else "",
        ]
        return " · ".join(part for part in parts if part)

    @property
    def last(self) -> str:
        """Return the last events in Markdown, the newest first."""
        return "  \n".join(self._last)


def _cut(text: str, most: int) -> str:
    """Return a text, or its beginning and an ellipsis: the list of events has all of it."""
    return text if len(text) <= most else f"{text[: most - 1].rstrip()}…"


def emphasised(text: str, cause: str) -> str:
    """Return the text of a trip with its first sentence in bold, which is a matter of type only."""
    plain = text.removeprefix(f"tripped ({cause}): ")
    first, stop, rest = plain.partition(". ")
    return f"**{markdown(first)}{stop.rstrip()}** {markdown(rest)}".rstrip() if plain else ""


def _in_words(event: Event, data: ChangeData, before: Mapping[str, str], after: Mapping[str, str]) -> str:
    """Return a change, such as ``kp_1_s2 6500 → 4500 at 14.172 s``."""
    steps = [
        f"{key.rpartition('.')[2]} {before.get(key, '-')} → {after.get(key, '-')}" for key in data.values
    ]
    return f"{', '.join(steps)} at {event.t:.3f} s"
