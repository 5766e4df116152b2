"""Periods that ran late: counted, and under `timing.overrun = "stop"` the end of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.trip_request import TripRequest, Urgency

if TYPE_CHECKING:
    from dcmp_hil.values import Timing

_LATE_MIN_PERIODS = 0.5  # of a period
_WINDOW_PERIODS = 20  # periods
_LEAK_PERIODS = 0.01  # of a period a period: no device's clock is further off than 1 %
_WARM_UP_S = 0.1  # s: the first periods find nothing in the caches, and the amplifier still at 0 V
_WINDOW_MASK = (1 << _WINDOW_PERIODS) - 1


class DeadlineMonitor:
    """Looks at the timing of each cycle.

    A period is late if its sample came more than half a period after its instant, or if its command took
    longer than a period. A device's clock runs off the host's, so the instant is that of the most punctual
    sample, forgotten by 1 % of a period a period. The first 0.1 s are counted and end nothing.

    Parameters
    ----------
    period
        s, nominal.
    limit
        Late ones of the last 20 periods that end the run; None for as many as there are.

    Attributes
    ----------
    count
        Late periods so far.
    """

    def __init__(self, period: float, limit: int | None = None) -> None:
        self.count = 0
        self._period, self._limit = period, limit
        self._leak, self._late = _LEAK_PERIODS * period, _LATE_MIN_PERIODS * period
        self._punctual = 0.0  # s, lateness of the most punctual sample
        self._recent = 0  # a bit a period, the newest last
        self._cold = round(_WARM_UP_S / period)  # periods to go

    def check(self, timing: Timing) -> TripRequest | None:
        """Judge the timing of one cycle; return a TripRequest if too many were late."""
        _, lateness, compute = timing
        punctual = self._punctual + self._leak
        behind = lateness - punctual
        if behind < 0.0:
            punctual, behind = lateness, 0.0
        self._punctual = punctual
        late = behind > self._late or compute > self._period
        if self._cold:
            self._cold -= 1
            self.count += late
        elif late or self._recent:
            self.count += late
            self._recent = recent = (self._recent << 1 | late) & _WINDOW_MASK
            if late and self._limit is not None and recent.bit_count() >= self._limit:
                return self._too_many(timing)
        return None

    def _too_many(self, timing: Timing) -> TripRequest:
        behind = timing.lateness - self._punctual
        return TripRequest(
            "deadline",
            f"{self._recent.bit_count()} of the last {_WINDOW_PERIODS} periods of {1e6 * self._period:.0f} "
            f"us were late; the last sample by {1e6 * behind:.0f} us, its command took "
            f"{1e6 * timing.compute:.0f} us.",
            "Close other programs, lower loop.rate_hz, see what the summary says was not granted, or set "
            'timing.overrun = "hold".',
            Urgency.RAMP,
            late=True,
        )
