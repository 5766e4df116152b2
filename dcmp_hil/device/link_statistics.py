"""Counters of a link during a run."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from dcmp_hil.device.clock_ratio import ClockRatio
from dcmp_hil.wire.link_diagnosis import LinkCounters, growth

if TYPE_CHECKING:
    from dcmp_hil.device.links.base import Link
    from dcmp_hil.wire.messages import Health, SampleReport

_LATE_MIN_PERIODS = 0.5  # of a period


class LinkStatistics:
    """Counts what is lost, late and damaged, from arming on.

    Parameters
    ----------
    link
        Counts the damage that it sees itself.
    period_ns
        ns, nominal.

    Attributes
    ----------
    counts
        What the backend counts; without the link's own damage, see `counters`.
    health
        The newest HEALTH, as the device sent it.
    """

    def __init__(self, link: Link, period_ns: float) -> None:
        self.counts = LinkCounters()
        self.health: Health | None = None
        self._link, self._period_ns, self._late_ns = link, period_ns, _LATE_MIN_PERIODS * period_ns
        self._first_health: Health | None = None
        self._damaged_before = 0
        self._clock = ClockRatio(period_ns)
        self._heard_ns, self._tick = 0, 0

    def start(self, tick: int, now_ns: int, health: Health | None) -> None:
        """Begin: what the link counted until now was before the run; `health` is the newest heard so far."""
        self.health = self._first_health = health
        self._damaged_before = self._link.corrupt
        self._heard_ns, self._tick = now_ns, tick

    def sample(self, report: SampleReport) -> None:
        """Count a new SAMPLE of a device in RUN."""
        counts = self.counts
        counts.samples += 1
        counts.missed += report.missed
        counts.limited += report.limited

    def heard(self, tick: int, now_ns: int) -> None:
        """Note the tick of the SAMPLE that will be answered, and the instant of its receipt, ns."""
        gone_ns = now_ns - self._heard_ns - (tick - self._tick) * self._period_ns
        self.counts.late += gone_ns > self._late_ns
        self._heard_ns, self._tick = now_ns, tick
        self._clock.add(tick, now_ns)

    def answered(self, now_ns: int) -> None:
        """Note the instant of the command, ns: one that took a period is too late."""
        self.counts.late += now_ns - self._heard_ns > self._late_ns

    def take_health(self, health: Health | None) -> None:
        """Store the newest HEALTH message; ignore None."""
        self.health = health or self.health
        if self._first_health is None:
            self._first_health = health

    @property
    def damaged(self) -> int:
        """Number of damaged frames received so far."""
        return self.counts.corrupt + self._link.corrupt - self._damaged_before

    @property
    def counters(self) -> LinkCounters:
        """Return a copy of all link counters."""
        first, last = self._first_health, self.health
        device = None if first is None or last is None or first is last else growth(first[:5], last[:5])
        return replace(self.counts, corrupt=self.damaged, device=device, clock_error=self._clock.error)
