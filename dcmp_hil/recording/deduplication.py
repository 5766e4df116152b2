"""The periods of a recording put in their order: what is there twice or of another run is left out."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dcmp_hil.recording.messages import log_times

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from dcmp_hil.recording.messages import Messages
    from dcmp_hil.values import Event


class Gap(NamedTuple):
    """A stretch of missing periods.

    Parameters
    ----------
    start, stop
        Device time of the last cycle before it and the first one behind it, s; None at an end of the run.
    periods
        How many; None where that is not known.
    """

    start: float | None
    stop: float | None
    periods: int | None

    def __str__(self) -> str:
        """Return the gap as a sentence."""
        many = (
            "what came later is missing"
            if self.periods is None
            else f"{self.periods} period{'s' * (self.periods != 1)} missing"
        )
        start = "the beginning" if self.start is None else f"{self.start:.6g} s"
        stop = "the end" if self.stop is None else f"{self.stop:.6g} s"
        return f"{many}, device time {start} to {stop}"


class OrderedContents(NamedTuple):
    """The rows and events of a recording in order, without duplicates.

    Parameters
    ----------
    rows
        Shape (n, len(FIELDS) or more).
    events
        In order.
    gaps
        Between the rows.
    faults
        What was mended or left out, as ends of sentences.
    """

    rows: NDArray[np.float64]
    events: tuple[Event, ...]
    gaps: tuple[Gap, ...]
    faults: tuple[str, ...]


def in_order(
    messages: Messages,
    began_ns: int,
    periods: int | None,
    events: int | None,
    event_of: Callable[[Mapping[str, Any]], Event],
) -> OrderedContents:
    """Return cycles and events in the order of their numbers.

    Parameters
    ----------
    messages
        As they stand in the file.
    began_ns
        When device time was 0, ns since 1970: a period of another run has another one.
    periods, events
        How many there were; None if it is not known.
    event_of
        Makes an event of a document, or raises ValueError.
    """
    faults: list[str] = []
    rows, numbers = messages.rows, messages.sequence
    own = messages.log_time == log_times(rows[:, 0], began_ns)
    if not own.all():
        faults.append(f"{int((~own).sum())} periods belong to another run")
        rows, numbers = rows[own], numbers[own]
    if (np.diff(numbers.astype(np.int64)) <= 0).any():
        _, first = np.unique(numbers, return_index=True)
        if len(first) < len(numbers):
            faults.append(f"{len(numbers) - len(first)} periods are there twice")
        if (np.diff(first) < 0).any():
            faults.append("its blocks stand in another order than they were written in")
        rows, numbers = rows[first], numbers[first]
    kept = _events(_parsed(messages, event_of, faults), began_ns, events, faults)
    return OrderedContents(rows, kept, _gaps(rows[:, 0], numbers.astype(np.int64), periods), tuple(faults))


def _parsed(
    messages: Messages, event_of: Callable[[Mapping[str, Any]], Event], faults: list[str]
) -> list[tuple[int, int, Event]]:
    parsed = []
    for number, log_time, text in messages.events:
        try:
            document = json.loads(text)
            if not isinstance(document, dict):
                raise ValueError("no object")  # noqa: TRY004, TRY301 - as what cannot be read
            parsed.append((number, log_time, event_of(document)))
        except (ValueError, RecursionError):
            pass
    if len(parsed) < len(messages.events):
        faults.append(f"{len(messages.events) - len(parsed)} events cannot be read")
    return parsed


def _events(
    said: list[tuple[int, int, Event]], began_ns: int, total: int | None, faults: list[str]
) -> tuple[Event, ...]:
    due = log_times(np.array([event.t for _, _, event in said], float), began_ns)
    own = [one for one, expected in zip(said, due.tolist(), strict=True) if one[1] == expected]
    if len(own) < len(said):
        faults.append(f"{len(said) - len(own)} events belong to another run")
    if any(number for number, _, _ in own):
        by_number = {number: event for number, _, event in reversed(own)}
        if len(by_number) < len(own):
            faults.append(f"{len(own) - len(by_number)} events are there twice")
        kept = tuple(by_number[number] for number in sorted(by_number))
        total = max(total or 0, *by_number)
    else:
        kept = tuple(event for _, _, event in own)
    if total is not None and total != len(kept):
        faults.append(f"{abs(total - len(kept))} events are {'missing' if total > len(kept) else 'too many'}")
    return kept


def _gaps(times: NDArray[np.float64], numbers: NDArray[np.int64], total: int | None) -> tuple[Gap, ...]:
    """Return where numbers are missing; an end that was not written is a gap as well."""
    if not len(numbers):
        return (Gap(None, None, total),) if total != 0 else ()
    gaps = [Gap(None, float(times[0]), int(numbers[0]) - 1)] if numbers[0] > 1 else []
    steps = np.diff(numbers)
    gaps += [
        Gap(float(times[k]), float(times[k + 1]), int(steps[k]) - 1)
        for k in np.flatnonzero(steps > 1).tolist()
    ]
    if total is None or total > numbers[-1]:
        gaps.append(Gap(float(times[-1]), None, None if total is None else total - int(numbers[-1])))
    return tuple(gaps)
