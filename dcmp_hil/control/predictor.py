"""The state ahead: the estimate carried over the voltages sent and not yet applied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.control.elementary import expm1, exponential
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.model import Model
    from dcmp_hil.values import Reference, Sample


_NEGLIGIBLE_F0_PERIOD, _SERIES_F0_PERIOD_MAX = 1e-17, 1e-2  # of f0 T; below the first, 1 - f0 T is 1


class LinearPredictor:
    """Exact prediction of x'' = -f0 x' + w + (ku/J) V with w and V held over each period.

    Parameters
    ----------
    model
        What the host believes of the plant.
    period
        s.
    delay_samples
        Periods between a sample and the instant at which its command takes effect: 0 or 1.
    measured
        Start from the encoder's position, as eq. (10) prints it, instead of x1_hat, which is quieter.
    """

    def __init__(self, model: Model, period: float, delay_samples: int, *, measured: bool = False) -> None:
        self._a, self._p1, self._p2 = held_input(model.f0, period)
        self._ku = model.ku
        self._measured = measured
        self._delayed = delay_samples == 1
        self._under_way = 0.0  # V

    def ahead(self, sample: Sample, estimate: Estimate, _: Reference) -> Estimate:
        """Return the state at the instant at which the next command takes effect."""
        x1, x2, w = estimate
        if self._measured:
            x1 = sample.position
        if self._delayed:
            drive, p1 = w + self._ku * self._under_way, self._p1
            x1 += p1 * x2 + self._p2 * drive
            x2 = self._a * x2 + p1 * drive
        return make(Estimate, (x1, x2, w))  # 0.09 us less

    def sent(self, voltage: float) -> None:
        """Remember what was just sent, V: it is under way until the next sample."""
        self._under_way = voltage


def held_input(f0: float, period: float) -> tuple[float, float, float]:
    """Discretise x'' = -f0 x' + d exactly for d held over `period`.

    Parameters
    ----------
    f0
        1/s, viscous friction over inertia; 0 is allowed.
    period
        s.

    Returns
    -------
    tuple
        (a, p1, p2): x1 += p1 x2 + p2 d; x2 = a x2 + p1 d.
    """
    a = exponential(-f0 * period)
    x = f0 * period
    if x < _NEGLIGIBLE_F0_PERIOD:
        return a, period, 0.5 * period * period
    p1 = -expm1(-x) / f0
    if x > _SERIES_F0_PERIOD_MAX:
        return a, p1, (period - p1) / f0
    # For small f0 T the closed form (T - p1)/f0 cancels; six terms are exact to double precision.
    series = 1 / 2 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x / 5040))))
    return a, p1, period * period * series
