"""Positions that no arm can have reached: one counts as a lost sample, three end the run."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from dcmp_hil.trip_request import TripRequest

if TYPE_CHECKING:
    from dcmp_hil.values import Estimate, Sample

_VELOCITY_LIMIT_RATIO = 4.0  # times the velocity limit: below, the limit itself is to act
_JUMP_MIN_COUNTS = 8.0  # counts: noise and the encoder's step at high rates
_OUTLIERS_MAX, _WINDOW_SAMPLES = 3, 100  # outliers, samples


class OutlierFilter:
    """Finds encoder counts that are wrong for a moment.

    Parameters
    ----------
    velocity_limit
        rad/s; infinity finds none.
    period
        s, nominal.
    count
        rad, one count of the encoder; 0 for an ideal one.

    Attributes
    ----------
    count
        Samples left out so far.
    usual
        rad, from one sample to the next: what needs no further look.
    speed, floor
        rad/s and rad: what is more than both of them since the last sample, is off.
    """

    def __init__(self, velocity_limit: float, period: float, count: float) -> None:
        self.speed, self.floor = _VELOCITY_LIMIT_RATIO * velocity_limit, _JUMP_MIN_COUNTS * count
        self.usual = max(self.speed * period, self.floor)  # rad, from one sample to the next
        self._stop: TripRequest | None = None
        self._x = self._t = math.nan
        self._samples = 0
        self._found: deque[int] = deque(maxlen=_OUTLIERS_MAX)
        self.count = 0

    def reject(self, sample: Sample) -> bool:
        """Return whether to read on: this sample's position is off, and may be left out."""
        self._samples += 1
        t, x, _, _ = sample
        if abs(x - self._x) <= self.usual:
            self._t, self._x = t, x
            return False
        return self._is_off(sample)

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:  # noqa: ARG002 - as every check
        """Object if there were too many up to this sample."""
        return self._stop

    def _is_off(self, sample: Sample) -> bool:
        moved = abs(sample.position - self._x)
        allowed = max(self.speed * (sample.t - self._t), self.floor)
        # The first sample, and what is no number, are for others to judge; a device's fault goes first.
        if not allowed < moved < math.inf or sample.fault:
            self._t, self._x, _, _ = sample
            return False
        self._found.append(self._samples)
        if len(self._found) < _OUTLIERS_MAX or self._samples - self._found[0] >= _WINDOW_SAMPLES:
            self.count += 1
            return True
        self._stop = jumped(sample.t, sample.position - self._x)
        return False


def jumped(t: float, moved: float) -> TripRequest:
    """Return the request to trip for a third jump, by `moved` (rad) at `t` (s, device time)."""
    return TripRequest(
        "jump",
        f"The position jumped by {moved:+.3f} rad at t = {t:.3f} s, the third jump within {_WINDOW_SAMPLES} "
        "samples.",
        "Look at the encoder's cable, screen and coupling.",
    )
