"""The pace of a simulation: tick n has its own instant of the clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil.platform.clock import Clock

_BACKLOG_MAX_NS = 1_000_000_000  # so far behind, the pace starts afresh instead of being caught up


class Pacer:
    """Sleeps until ticks.

    Parameters
    ----------
    clock
        What to sleep on.
    period
        s.
    """

    def __init__(self, clock: Clock, period: float) -> None:
        self._clock = clock
        self._tick = 0  # the one that was waited for last
        self._period_ns = 1e9 * period
        self._start_ns = clock.now_ns()

    def start(self) -> None:
        """Take the present instant as that of tick 0."""
        self._start_ns = self._clock.now_ns()

    def stretch(self, factor: float) -> None:
        """Make one period `factor` times as long, from the newest tick on."""
        before, self._period_ns = self._period_ns, factor * self._period_ns
        self._start_ns += int(self._tick * (before - self._period_ns))

    def missed(self, tick: int) -> int:
        """Count the ticks after `tick` whose instants have passed as well."""
        behind_ns = self._clock.now_ns() - self._start_ns - int(tick * self._period_ns + 0.5)
        return int(behind_ns / self._period_ns) if 0 < behind_ns <= _BACKLOG_MAX_NS else 0

    def wait_for(self, tick: int) -> None:
        """Return no earlier than the instant of `tick`."""
        self._tick = tick
        deadline_ns = self._start_ns + int(tick * self._period_ns + 0.5)
        self._clock.sleep_until_ns(deadline_ns)
        behind_ns = self._clock.now_ns() - deadline_ns
        if behind_ns > _BACKLOG_MAX_NS:
            self._start_ns += behind_ns  # after a stop of the process: no burst of old periods
