"""The figures of a run, block by block, in bounded memory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.telemetry.friction_findings import FrictionFindings, FrictionStatistics

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event

BOUNDS_US = (*(mantissa * 10.0**power for power in range(6) for mantissa in (1.0, 2.0, 5.0)), 1e6)
_LATE_MIN_PERIODS = 0.5  # of a period: a sample that arrives later than this counts as late


@dataclass(frozen=True, slots=True)
class Percentiles:
    """Quantiles of a duration, us; NaN where there was none. The maximum is exact, the others to 0.5 %."""

    p50: float
    p99: float
    p999: float
    max: float


@dataclass(frozen=True, slots=True)
class DurationHistogram:
    """Histogram of durations, with a resolution of 1 %."""

    up_to_us: tuple[float, ...]
    """1, 2, 5, 10 ... us, as far as there is anything; what is above a second is infinite."""
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Summary:
    """The figures of a run, over `window_s` of device time; the names are a promise.

    Errors are against the truth where it is known (the simulated rig); tracking then means the true
    position minus the reference at the same instant, otherwise the measured one. None: not known.
    """

    tracking_rms_rad: float | None
    tracking_max_rad: float | None
    velocity_error_rms_rad_s: float | None
    velocity_error_max_rad_s: float | None
    disturbance_error_rms_rad_s2: float | None
    voltage_peak_V: float | None
    voltage_tv_V_s: float | None
    """Total variation of the voltage sent, per second."""
    periods: int
    late_periods: int
    """Periods whose sample arrived more than half a period late."""
    period_us: Percentiles
    lateness_us: Percentiles
    compute_us: Percentiles
    """From a sample's arrival to its command's departure."""
    period_histogram: DurationHistogram
    lateness_histogram: DurationHistogram
    compute_histogram: DurationHistogram
    rate_error_ppm: float | None
    """By how much samples came too slowly (+) by the host's clock, from both ends of the window."""
    realtime_factor: float
    """Device time over wall time, the whole run."""
    window_s: tuple[float, float]
    friction: FrictionFindings | None = None
    """Findings of an observer that finds friction by itself; None of the others."""


def summed(total: float, values: NDArray[np.float64]) -> float:
    """Return a total with further values added one after the other, in their order.

    So a sum has the same bits on every computer, at any length of the blocks, and in a lane of a sweep. The
    product of two arrays would take the order of the computer's own library.
    """
    return float(np.add.accumulate(np.concatenate(([total], values)))[-1])


def known_of(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values that are numbers; a copy only where some are none."""
    unknown = np.isnan(values)
    return values[~unknown] if unknown.any() else values


class ErrorStatistics:
    """Root mean square and maximum of a column that comes in pieces; NaN is left out."""

    def __init__(self) -> None:
        self._n, self._squares, self._max = 0, 0.0, 0.0

    def add(self, values: NDArray[np.float64]) -> None:
        """Add the next block."""
        known = known_of(values)
        if len(known):
            self._n += len(known)
            self._squares = summed(self._squares, known * known)
            self._max = max(self._max, float(np.abs(known).max()))

    @property
    def rms(self) -> float | None:
        """Root mean square."""
        return math.sqrt(self._squares / self._n) if self._n else None

    @property
    def max(self) -> float | None:
        """Largest absolute value."""
        return self._max if self._n else None


class Durations:
    """Quantiles of durations, by a histogram with bins of 1 % from 10 ns to 1000 s."""

    _FIRST, _BINS_E = 1e-8, 100.0  # s; bins an e-fold
    _N = int(_BINS_E * math.log(1e11)) + 2
    # bins below each bound
    _BOUNDS = np.rint(np.log(np.array(BOUNDS_US) * 1e-6 / _FIRST) * _BINS_E).astype(np.int64)

    def __init__(self) -> None:
        self.counts = np.zeros(self._N, np.int64)
        self._min, self._max = math.inf, -math.inf

    def add(self, values: NDArray[np.float64]) -> None:
        """Add the next block of durations, s; NaN is left out."""
        known = known_of(values)
        if not len(known):
            return
        least, most = float(known.min()), float(known.max())
        self._min, self._max = min(self._min, least), max(self._max, most)
        first, last = self._bins(np.array((least, most)))
        if first == last:  # as in virtual time
            self.counts[first] += len(known)
        else:
            self.counts += np.bincount(self._bins(known), minlength=self._N)

    def _bins(self, values: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the numbers of the bins of durations, s."""
        bins = np.log(np.maximum(values, self._FIRST) / self._FIRST) * self._BINS_E
        return np.minimum(bins.astype(np.int64), self._N - 1)

    def percentiles(self) -> Percentiles:
        """Return the quantiles in us."""
        total = int(self.counts.sum())
        if not total:
            return Percentiles(math.nan, math.nan, math.nan, math.nan)
        ranks = np.ceil(np.array([0.5, 0.99, 0.999]) * total)
        bins = np.searchsorted(np.cumsum(self.counts), ranks)
        middle = self._FIRST * np.exp((bins + 0.5) / self._BINS_E)
        p50, p99, p999 = (round(1e6 * float(v), 3) for v in np.clip(middle, self._min, self._max))
        return Percentiles(p50, p99, p999, round(1e6 * self._max, 3))

    def histogram(self) -> DurationHistogram:
        """Return the counts between 1, 2, 5, 10 ... us."""
        below = np.append(np.cumsum(self.counts), 0)[self._BOUNDS - 1]
        counts = np.diff(below, prepend=0, append=self.counts.sum())
        some = np.flatnonzero(counts)
        if not len(some):
            return DurationHistogram((), ())
        shown = slice(int(some[0]), int(some[-1]) + 1)
        return DurationHistogram((*BOUNDS_US, math.inf)[shown], tuple(counts[shown].tolist()))


class Statistics:
    """A sink that computes the Summary of a run.

    Parameters
    ----------
    period
        s, nominal.
    window_from, window_to
        s, device time; periods outside count for nothing but `realtime_factor`.
    """

    def __init__(self, period: float, window_from: float = 0.0, window_to: float = math.inf) -> None:
        self._period = period
        self._from, self._to = window_from, window_to
        self._tracking, self._velocity, self._disturbance = (
            ErrorStatistics(),
            ErrorStatistics(),
            ErrorStatistics(),
        )
        self.period, self.lateness, self.compute = Durations(), Durations(), Durations()
        self._friction = FrictionStatistics()
        self._periods = self._late = 0
        self._peak = self._variation = 0.0
        self._last_voltage = math.nan
        self._first_t = self._last_t = math.nan
        self._first_lateness = self._last_lateness = math.nan

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        t = block["t"]
        inside = np.flatnonzero((t >= self._from - 0.5 * self._period) & (t < self._to))
        if not len(inside):
            return
        window = slice(int(inside[0]), int(inside[-1]) + 1)
        self._tracking.add(block.tracking_error[window])
        self._velocity.add((block["velocity_estimate"] - block["velocity_true"])[window])
        self._disturbance.add((block["disturbance_estimate"] - block["disturbance_true"])[window])
        self.period.add(block["period"][window])
        self.lateness.add(block["lateness"][window])
        self.compute.add(block["compute"][window])
        self._periods += len(inside)
        self._late += int((block["lateness"][window] > _LATE_MIN_PERIODS * self._period).sum())
        self._add_voltage(block["voltage_sent"][window])
        self._friction.add(block, window)
        if math.isnan(self._first_t):
            self._first_t, self._first_lateness = float(t[window][0]), float(block["lateness"][window][0])
        self._last_t, self._last_lateness = float(t[window][-1]), float(block["lateness"][window][-1])

    def event(self, event: Event) -> None:
        """Events are no figures."""

    def close(self) -> None:
        """Nothing to finish."""

    def summary(self, realtime_factor: float) -> Summary:
        """Return the summary of the blocks so far."""
        span = self._last_t - self._first_t
        return Summary(
            tracking_rms_rad=self._tracking.rms,
            tracking_max_rad=self._tracking.max,
            velocity_error_rms_rad_s=self._velocity.rms,
            velocity_error_max_rad_s=self._velocity.max,
            disturbance_error_rms_rad_s2=self._disturbance.rms,
            voltage_peak_V=self._peak if self._periods else None,
            voltage_tv_V_s=self._variation / span if span > 0 else None,
            periods=self._periods,
            late_periods=self._late,
            period_us=self.period.percentiles(),
            lateness_us=self.lateness.percentiles(),
            compute_us=self.compute.percentiles(),
            period_histogram=self.period.histogram(),
            lateness_histogram=self.lateness.histogram(),
            compute_histogram=self.compute.histogram(),
            rate_error_ppm=1e6 * (self._last_lateness - self._first_lateness) / span if span > 0 else None,
            realtime_factor=realtime_factor,
            window_s=(self._first_t, self._last_t + self._period)
            if self._periods
            else (self._from, self._from),
            friction=self._friction.findings(),
        )

    def _add_voltage(self, voltage: NDArray[np.float64]) -> None:
        self._peak = max(self._peak, float(np.abs(voltage).max()))
        steps = np.abs(np.diff(voltage, prepend=self._last_voltage))
        self._variation = summed(self._variation, known_of(steps))  # nothing is before the very first
        self._last_voltage = float(voltage[-1])
