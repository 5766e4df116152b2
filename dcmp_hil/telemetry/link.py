"""What was lost and damaged between host and device, told once a second."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from dcmp_hil.values import Event

if TYPE_CHECKING:
    from collections.abc import Callable

HOST = ("lost", "stale", "skipped", "corrupt")
"""Counters of the host's side, in the order in which they are told."""
DEVICE = ("crc_errors", "sequence_gaps", "ring_overruns", "bus_offs", "late_ticks")
"""Counters of the device's side: HEALTH, which stop at 255."""


class LinkWatch:
    """Tells of a backend's counters.

    Parameters
    ----------
    backend
        One without a wire has no `counters`, and nothing is told.
    periods
        Between two times.
    tell
        Takes the event.
    """

    def __init__(self, backend: Any, periods: int, tell: Callable[[Event], None]) -> None:
        self._backend, self._periods, self._tell = backend, periods, tell
        self._left = periods if hasattr(backend, "counters") else 0

    def look(self, t: float) -> None:
        """Take the device time of a period, s."""
        self._left -= 1
        if not self._left:
            self._left = self._periods
            self._tell(Event(t, "LINK", in_text(self._backend)))


def in_text(backend: Any) -> str:
    """Return the counters of both sides, those of the device as far as it told them."""
    counters: dict[str, int] = asdict(backend.counters)
    health = getattr(backend, "health", None)
    if health is not None:
        counters |= {name: getattr(health, name) for name in DEVICE}
    return " ".join(f"{name}={count}" for name, count in counters.items())


def counters(text: str) -> dict[str, float]:
    """Return the counters in the text of an event; NaN for what nobody told."""
    told = dict(pair.split("=") for pair in text.split())
    return {name: float(told.get(name, "nan")) for name in (*HOST, *DEVICE)}
