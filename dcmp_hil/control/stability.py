"""The exact loop as a matrix: plant, delay, observer, predictor and controller of one period, linear.

The plant is held-input exact, its command acts one sample late, the observer is `super_twisting` with its
gains at a fixed bandwidth and is fed the voltage applied. What stays out is what is not linear: Coulomb
friction, gravity, saturation, the encoder's steps and the sliding term, which raises the bandwidth while the
innovation is small; `bandwidths` says how far.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.control.observers.discretisation import luenberger_copy, matched_gains
from dcmp_hil.control.predictor import held_input

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from dcmp_hil.control.controllers import Gains
    from dcmp_hil.control.model import Model
    from dcmp_hil.control.observers.discretisation import LuenbergerCopy
    from dcmp_hil.control.observers.super_twisting import Tuning

    Matrix = NDArray[np.float64]

STATE_COUNT = 11
_P, _V, _APPLIED, SENT, _Y, _Z1, _Z2, _V1, _V2, _V3, NOISE = range(STATE_COUNT)
_GROWTH_MIN_1_S = 0.1  # 1/s: what grows more slowly than that is a drift
_SLIDING_INNOVATION_COUNTS = 0.15  # counts: the innovation at which the sliding term counts, M = 0.15 q mu^3
_GAIN_DECADES = 1.0  # that are searched
_STEPS_PER_DECADE = 12
_SEARCH_HALVINGS = 12  # refinements of the search
_HISTORY_DOUBLINGS = 14  # 16,384 periods are looked back on: a drift has no end
_FREQUENCY_MIN_RAD_S, _FREQUENCY_COUNT = 0.05, 2000  # rad/s; of the frequency response, up to half the rate
UNMODELLED_RATIO = 1.1  # simulated variation over that of the linear loop, within 4 % over 189 sets of gains


class LoopSpec(NamedTuple):
    """Parameters of the linear loop whose stability is judged.

    Parameters
    ----------
    model
        What observer and controller believe, and the plant is.
    period
        s.
    delay_samples
        0 or 1.
    measured
        Whether the controller is given the encoder's position.
    resolution
        rad, one count of the encoder; 0 for an ideal one.
    """

    model: Model
    period: float
    delay_samples: int
    measured: bool
    resolution: float


class Margins(NamedTuple):
    """Between which gains of the motor, as a multiple of the believed one, the loop is stable."""

    low: float
    high: float


class Robustness(NamedTuple):
    """Margins of the loop, opened at the motor: the smallest over its crossings of gain 1."""

    phase_deg: float
    crossover_rad_s: float  # where that is
    delay_s: float
    sensitivity: float  # largest magnitude of 1 / (1 + L)


class LoopNumbers(NamedTuple):
    """Coefficients of one period of a linear loop."""

    gains: Gains
    tuning: Tuning
    copy: LuenbergerCopy
    correction: tuple[float, float, float]
    held: tuple[float, float, float]


class LinearLoop:
    """The loop of one rig with one set of gains.

    Parameters
    ----------
    spec
        Of the rig.
    gains
        Of the controller.
    tuning
        Of the observer.
    bandwidth
        rad/s, of the differentiator.
    """

    def __init__(self, spec: LoopSpec, gains: Gains, tuning: Tuning, bandwidth: float) -> None:
        self._spec, self._gains, self._tuning = spec, gains, tuning
        step = spec.period
        self._copy = _copy_of(step, spec.model.f0, tuning.L1, tuning.L2)
        k1, k2, k3 = matched_gains(bandwidth * step)
        self._correction = (k1, k2 / step, k3 / (step * step))
        self._held = held_input(spec.model.f0, step)

    @property
    def spec(self) -> LoopSpec:
        """Parameters of the loop."""
        return self._spec

    @property
    def numbers(self) -> LoopNumbers:
        """Coefficients of one period."""
        return LoopNumbers(self._gains, self._tuning, self._copy, self._correction, self._held)

    def matrix(self, motor: float = 1.0) -> Matrix:
        """Return what one period does to the state, with a motor so many times as strong as believed."""
        return self._period(np.eye(STATE_COUNT), motor)

    def radius(self, motor: float = 1.0) -> float:
        """Return the largest magnitude of an eigenvalue; infinity where there is none."""
        matrix = self.matrix(motor)[:NOISE, :NOISE]
        if not np.isfinite(matrix).all():
            return math.inf
        return float(np.abs(np.linalg.eigvals(matrix)).max())

    def stable(self, motor: float = 1.0) -> bool:
        """Return whether nothing grows faster than a drift."""
        return self.radius(motor) < math.exp(_GROWTH_MIN_1_S * self._spec.period)

    def margins(self) -> Margins | None:
        """Return the gains of the motor between which the loop is stable; None if it is not at 1."""
        if not self.stable():
            return None
        return Margins(self._edge(-1.0), self._edge(1.0))

    def noise_V(self) -> tuple[float, float]:
        """Return the standard deviations of voltage and of its change in a period that a count costs, V."""
        matrix = self.matrix()
        loop, drive = matrix[:NOISE, :NOISE], matrix[:NOISE, NOISE]
        with np.errstate(all="ignore"):
            power, spread = loop.copy(), np.outer(drive, drive)
            for _ in range(_HISTORY_DOUBLINGS):
                spread = spread + power @ spread @ power.T
                power = power @ power
        if not np.isfinite(spread).all():
            return math.inf, math.inf
        noise = self._spec.resolution / math.sqrt(12.0)
        now = spread[SENT, SENT]
        next_ = loop[SENT] @ spread @ loop[SENT] + drive[SENT] ** 2
        both = loop[SENT] @ spread[:, SENT]
        change = max(0.0, now + next_ - 2.0 * both)
        return noise * math.sqrt(max(0.0, now)), noise * math.sqrt(change)

    def variation_V_s(self) -> float:
        """Return the mean of |dV/dt| that a count costs, V/s: the steps of the encoder as white noise."""
        _, change = self.noise_V()
        return UNMODELLED_RATIO * math.sqrt(2.0 / math.pi) * change / self._spec.period

    def response(self, frequencies: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return L(exp(j w T)) with the loop broken at the motor; shape (n,), of w in rad/s.

        The state of a period is A0 + m b c with a motor m times as strong as believed, so that
        det(z - A0 - m b c) = det(z - A0) (1 + m L) with L = -c (z - A0)^-1 b.
        """
        still = self.matrix(0.0)[:NOISE, :NOISE]
        both = self.matrix(1.0)[:NOISE, :NOISE] - still
        row = both[_V]
        column = both[:, np.argmax(np.abs(row))] / row[np.argmax(np.abs(row))]
        z = np.exp(1j * frequencies * self._spec.period)
        lines = z[:, None, None] * np.eye(NOISE) - still
        solved = np.linalg.solve(lines, np.broadcast_to(column, (len(z), NOISE))[..., None])[..., 0]
        return np.asarray(-(solved @ row), np.complex128)

    def robustness(self) -> Robustness | None:
        """Return margins of phase and delay and the peak of sensitivity; None where it is not stable."""
        if not self.stable():
            return None
        w = np.geomspace(_FREQUENCY_MIN_RAD_S, math.pi / self._spec.period * (1.0 - 1e-9), _FREQUENCY_COUNT)
        loop = self.response(w)
        size = np.log(np.abs(loop))
        at = np.flatnonzero(np.diff(np.sign(size)) != 0.0)
        share = size[at] / (size[at] - size[at + 1])
        crossed = w[at] * (w[at + 1] / w[at]) ** share
        turn = loop[at + 1] / loop[at]
        phase = np.angle(-loop[at] * np.exp(1j * share * np.angle(turn)))  # over -180 degrees, -pi to pi
        peak = float(1.0 / np.abs(1.0 + loop).min())
        if not len(at):
            return Robustness(math.inf, math.nan, math.inf, peak)
        least = int(np.argmin(np.abs(phase)))
        delay = np.where(phase >= 0.0, phase, phase + 2.0 * math.pi) / crossed
        return Robustness(
            math.degrees(abs(float(phase[least]))), float(crossed[least]), float(delay.min()), peak
        )

    def _edge(self, way: float) -> float:
        """Search for the end of stability upwards or downwards from 1."""
        inside, step = 0.0, way * _GAIN_DECADES / _STEPS_PER_DECADE
        for k in range(1, _STEPS_PER_DECADE + 1):
            if not self.stable(10.0 ** (k * step)):
                outside = k * step
                break
            inside = k * step
        else:
            return float(10.0**inside)
        for _ in range(_SEARCH_HALVINGS):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if self.stable(10.0**middle) else (inside, middle)
        return float(10.0**inside)

    @np.errstate(all="ignore")  # gains beyond all reason overflow, and are refused by what comes of it
    def _period(self, s: Matrix, motor: float) -> Matrix:
        """Carry states (as rows of `s`) over one period: the line of the loop, and then the plant."""
        model, step, tuning = self._spec.model, self._spec.period, self._tuning
        f11, f12, f21, f22, gu1, gu2, h01, h02, h11, h12 = self._copy
        k1, k2, k3 = self._correction
        y, u = s[_P] + s[NOISE], model.ku * s[_APPLIED]
        z1 = f11 * s[_Z1] + f12 * s[_Z2] + gu1 * u + h01 * s[_Y] + h11 * y
        z2 = f21 * s[_Z1] + f22 * s[_Z2] + gu2 * u + h02 * s[_Y] + h12 * y
        v1, v2, v3 = s[_V1] + step * (s[_V2] + 0.5 * step * s[_V3]), s[_V2] + step * s[_V3], s[_V3]
        b = y - z1 - v1
        v1, v2, v3 = v1 + k1 * b, v2 + k2 * b, v3 + k3 * b
        L1, L2, f0 = tuning.L1, tuning.L2, model.f0
        x1, x2 = z1 + v1, z2 + v2 + L1 * v1
        w = v3 + (L1 + f0) * v2 + (L2 + f0 * L1) * v1
        voltage = self._voltage(y if self._spec.measured else x1, x2, w, s[SENT])
        applied = s[SENT] if self._spec.delay_samples else voltage
        a, p1, p2 = self._held
        drive = motor * model.ku * applied
        after = np.zeros_like(s)
        after[_P], after[_V] = s[_P] + p1 * s[_V] + p2 * drive, a * s[_V] + p1 * drive
        after[_APPLIED], after[SENT], after[_Y] = applied, voltage, y
        after[_Z1], after[_Z2], after[_V1], after[_V2], after[_V3] = z1, z2, v1, v2, v3
        return after

    def _voltage(self, x1: Matrix, x2: Matrix, w: Matrix, sent: Matrix) -> Matrix:
        model, (kp, kd, compensation) = self._spec.model, self._gains
        if self._spec.delay_samples:
            a, p1, p2 = self._held
            drive = w + model.ku * sent
            x1, x2 = x1 + p1 * x2 + p2 * drive, a * x2 + p1 * drive
        volts: Matrix = (-compensation * w - kp * x1 - kd * x2 + model.f0 * x2) / model.ku
        return volts


@lru_cache(maxsize=64)  # the loops of a rig differ by their bandwidth, and those of a sweep often by less
def _copy_of(step: float, f0: float, gain1: float, gain2: float) -> LuenbergerCopy:
    return luenberger_copy(step, f0, gain1, gain2)


def bandwidths(tuning: Tuning, count: float) -> Sequence[float]:
    """Return the bandwidths of the differentiator, rad/s: its floor, and the sliding term's at a count."""
    sliding = (tuning.M / (_SLIDING_INNOVATION_COUNTS * count)) ** (1 / 3) if count > 0.0 else 0.0
    return [mu for mu in (tuning.mu0, sliding) if mu >= max(tuning.mu0, 1e-9)]
