"""Events on lost and damaged frames between host and device, once a second."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from dcmp_hil.values import CauseData, Event, EventKind, LinkData

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from dcmp_hil.wire.link_diagnosis import Concern, LinkCounters

HOST_COUNTERS = ("lost", "stale", "skipped", "corrupt", "missed", "limited", "late")
"""Counters of the host's side, in the order in which they are told."""
DEVICE_COUNTERS = ("crc_errors", "sequence_gaps", "ring_overruns", "bus_offs", "late_ticks")
"""Counters of the device's side: HEALTH, which stop at 255."""


class LinkWatch:
    """Tells of a backend's counters, and warns of what they mean.

    Parameters
    ----------
    backend
        One without a wire has no `counters`, and nothing is told.
    periods
        Between two times.
    tell
        Takes the event.

    Attributes
    ----------
    concerns
        What was warned of, each cause once, in the order of time.
    """

    def __init__(self, backend: Any, periods: int, tell: Callable[[Event], None]) -> None:
        self.concerns: dict[str, Concern] = {}
        self._backend, self._periods, self._tell = backend, periods, tell
        self._left = periods if hasattr(backend, "counters") else 0
        self._before: LinkCounters | None = None

    def look(self, t: float) -> None:
        """Report the counters if a second has passed at device time `t`, s."""
        self._left -= 1
        if not self._left:
            self._left = self._periods
            counters = told_by(self._backend)
            text = " ".join(f"{name}={count}" for name, count in counters.items())
            self._tell(Event(t, "DEBUG", EventKind.LINK, text, LinkData(counters)))
            self._judge(t)

    def finish(self, t: float) -> None:
        """Judge the whole run, which ends at a device time (s)."""
        judge = getattr(self._backend, "concerns", None)
        if judge is None or not self._backend.counters.samples:  # it never began
            return
        self._before = None
        self._judge(t)
        for concern in judge(self._backend.counters):
            self.concerns[concern.cause] = concern

    def _judge(self, t: float) -> None:
        """Warn of what the newest second shows, and the run so far."""
        judge = getattr(self._backend, "concerns", None)
        if judge is None:
            return
        counters = self._backend.counters
        found = judge(counters)
        if self._before is not None:
            found += judge(counters.since(self._before))
        self._before = counters
        for concern in found:
            if concern.cause not in self.concerns:
                self.concerns[concern.cause] = concern
                cause = CauseData(concern.cause)
                self._tell(Event(t, "WARN", EventKind.LINK_CONCERN, concern.text, cause))


def told_by(backend: Any) -> dict[str, int]:
    """Return the counters of both sides, those of the device as far as it told them."""
    told = backend.counters
    counters: dict[str, int] = {name: getattr(told, name) for name in HOST_COUNTERS}
    health = getattr(backend, "health", None)
    if health is not None:
        counters |= {name: getattr(health, name) for name in DEVICE_COUNTERS}
    return counters


def in_order(counters: Mapping[str, int]) -> list[float]:
    """Return the counters of the host, then of the device; NaN for one that was not reported."""
    return [float(counters.get(name, math.nan)) for name in (*HOST_COUNTERS, *DEVICE_COUNTERS)]
