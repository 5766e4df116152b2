"""Chatter: a voltage that changes far more than these gains, this encoder and this reference explain."""

from __future__ import annotations

import math
from collections import deque
from functools import partial, reduce
from itertools import pairwise
from operator import add
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.errors import Explanation
from dcmp_hil.trip_request import TripRequest, Urgency

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from dcmp_hil.values import Sample

FLOOR_V_S = 1000.0
"""V/s, below which nothing is chatter."""
_VARIATION_RATIO_MAX = 10.0  # the expected variation, from which on it is chatter
BLOCK_DURATION_S = 0.05  # s, over which the variation is a mean
_WINDOW_BLOCKS = 10  # half a second
_PAUSE_SHARE_MAX = 0.5  # of what is allowed: two blocks below it are a pause
_BURST_WEIGHT = 2  # of a block with chatter, in the score of bursts with pauses
_PAUSE_WEIGHT = 1  # of a block without
_BURST_SCORE_MAX = 40  # at which it is chatter
_SAMPLES_MIN = 12  # samples that say anything
_SWING_COUNTS, _SWING_RAD = 10.0, 5e-3  # of the arm, peak to peak
_DRIFT_ORDER = 3  # of a polynomial: what is no swing
_LAGS_PERIODS = 4  # periods from a count to the voltage that it makes
_CORRELATION_MIN = 0.5  # correlation


class Chatter:
    """Judges the variation of the voltage sent, block by block.

    Parameters
    ----------
    expected
        V/s, mean of |dV/dt| that gains, encoder and reference explain.
    period
        s, nominal.
    count
        rad, one count of the encoder; 0 for an ideal one.

    Attributes
    ----------
    expected
        As given.
    block
        Periods of a block.
    samples
        The newest samples, for the diagnosis.
    """

    def __init__(self, expected: float, period: float, count: float) -> None:
        self.block = block_cycles(period)
        self.samples: Collection[Sample] = ()
        self._count = count
        self._rates: deque[float] = deque(maxlen=_WINDOW_BLOCKS + 1)  # V/s, of the newest blocks
        self._bursts = 0
        self._t = math.nan
        self.expected = self._limit = math.nan
        self.expect(expected)

    def expect(self, variation: float) -> None:
        """Set the expected variation after a change of gains, V/s."""
        self.expected, self._limit = variation, limit_V_s(variation)

    def judge(self, t: float, change: float) -> TripRequest | None:
        """Judge the sum of |dV| (V) of a block that ends at `t` (s, device time); return a request to trip.

        That is half a second with a mean from the limit on and no pause in it; or bursts, for longer.
        """
        gone, self._t = t - self._t, t
        if not gone > 0.0:  # the first
            return None
        self._rates.append(change / gone)
        rates, quiet = list(self._rates), 2.0 * _PAUSE_SHARE_MAX * self._limit
        # One after the other: from Python 3.12 on, sum() of floats rounds otherwise.
        mean = reduce(add, rates[-_WINDOW_BLOCKS:], 0.0) / _WINDOW_BLOCKS
        goes_on = mean >= self._limit and sum(rates[-2:]) >= quiet
        self._bursts = self._bursts + _BURST_WEIGHT if goes_on else max(0, self._bursts - _PAUSE_WEIGHT)
        steady = goes_on and len(rates) > _WINDOW_BLOCKS and all(a + b >= quiet for a, b in pairwise(rates))
        if not steady and self._bursts < _BURST_SCORE_MAX:
            return None
        return chattering(t, mean, self.expected, self._cause)

    def _cause(self) -> tuple[str, str]:
        return cause_of(self.samples, self._count)


def chattering(t: float, mean: float, expected: float, find: Callable[[], tuple[str, str]]) -> TripRequest:
    """Return the request to trip for a voltage that chatters.

    Parameters
    ----------
    t
        s, device time.
    mean, expected
        V/s, variation in the last half second, and what this rig explains of it.
    find
        Finds the likely cause and its remedy.
    """
    said = (
        f"it changed by {mean:,.0f} V/s on average in the half second before t = {t:.3f} s; "
        f"{expected:,.0f} V/s are expected with this rig, {limit_V_s(expected):,.0f} allowed."
    )
    sentence, remedy = _CONTROLLER
    explain = partial(_explanation, said, find)
    return TripRequest("chatter", f"{sentence}: {said}", remedy, Urgency.RAMP, explain=explain)


def _explanation(said: str, find: Callable[[], tuple[str, str]]) -> Explanation:
    sentence, remedy = find()
    return Explanation("chatter", f"{sentence}: {said}", remedy)


def block_cycles(period: float) -> int:
    """Return the cycles of a block; `period` in s."""
    return max(1, round(BLOCK_DURATION_S / period))


def limit_V_s(expected: float) -> float:
    """Return the variation from which on it is chatter, V/s."""
    return max(FLOOR_V_S, _VARIATION_RATIO_MAX * expected)


_CONTROLLER = (
    "The voltage chatters, and neither the arm nor the encoder explains it",
    "Look for a controller that switches, such as a sign() without a boundary layer, and for its gains.",
)
_ENCODER = (
    "The voltage chatters with the steps of the encoder",
    "Lower the gains (controller.kd_1_s, observer.mu0_rad_s, L1_1_s, M_rad_s3), and look at the encoder.",
)
_SWING = (
    "The voltage chatters because the loop swings",
    "Lower the gains, and compare model.ku_rad_s2_V and loop.delay_samples with the rig.",
)


def cause_of(samples: Collection[Sample], count: float) -> tuple[str, str]:
    """Return the likely cause of a chattering voltage, and a remedy.

    Parameters
    ----------
    samples
        The newest ones, with the voltages applied.
    count
        rad, one count of the encoder; 0 for an ideal one.
    """
    if len(samples) < _SAMPLES_MIN:
        return _CONTROLLER
    t, position, voltage, _ = np.array(list(samples), float).T
    if not (np.isfinite(t + position + voltage).all() and (np.diff(t) > 0.0).all()):
        return _CONTROLLER
    moved = position - np.polyval(np.polyfit(t - t[0], position, _DRIFT_ORDER), t - t[0])
    change, step = np.diff(voltage), np.diff(position)
    smooth = min(_correlation(voltage[1:], voltage[:-1]), _correlation(step[1:], step[:-1]))
    if smooth > _CORRELATION_MIN and float(np.ptp(moved)) > max(_SWING_COUNTS * count, _SWING_RAD):
        return _SWING
    follows = max(abs(_correlation(change[lag:], step[: len(step) - lag])) for lag in range(_LAGS_PERIODS))
    return _ENCODER if follows > _CORRELATION_MIN else _CONTROLLER


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Return the correlation; 0 where one of the two does not vary."""
    if not (one.std() > 0.0 and other.std() > 0.0):
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])
