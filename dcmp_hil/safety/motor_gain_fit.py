"""Least squares for the motor's gain, of sums that grow with each sample.

There is no list of samples, and no linear algebra of a library: `firmware/core/dcmp_polarity_check.h` has the
same operations in the same order, and so the same bits.
"""

from __future__ import annotations

import math

from dcmp_hil.control.elementary import sine

_NOISE_COUNTS, _NOISE_MIN_RAD = 0.4, 1e-4  # counts and rad, of a position
_DISTURBANCE_RAD_S2 = 2.0  # rad/s2, what may push besides
_MOTOR_GAIN_RATIO_MAX = 3.0  # times the believed motor gain

_Sums = tuple[float, float, float, float, float, float, float, float, float]


class MotorGainFit:
    """Fits the motor's gain, a constant push and an error of the first position to the way out.

    Friction is constant until the arm turns, so that only the samples up to the newest farthest point count.

    Parameters
    ----------
    ku
        (rad/s2)/V, the believed motor gain ku/J.
    gravity
        rad/s2, of the pendulum, as believed.
    count
        rad, one count of the encoder; 0 for an ideal one.

    Attributes
    ----------
    farthest
        rad, either way, that the arm has moved at most.
    """

    def __init__(self, ku: float, gravity: float, count: float) -> None:
        self._ku, self._gravity, self._count = ku, gravity, count
        self._t = 0.0  # s, of the last sample
        self._speed = self._m = 0.0  # of a motor whose gain is 1
        self._fall_speed = self._fall = 0.0  # rad/s and rad, from gravity
        self._sums: _Sums = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._out = self._sums  # at the newest farthest point
        self.farthest = 0.0

    def add(self, t: float, moved: float, voltage: float) -> None:
        """Take in a sample.

        Parameters
        ----------
        t
            s, since the pushes began.
        moved
            rad, since then.
        voltage
            V, applied in the period that ended at `t`.
        """
        step, self._t = t - self._t, t
        self._speed += step * voltage
        self._m += step * (self._speed - 0.5 * step * voltage)
        pull = self._gravity * sine(moved)
        self._fall_speed += step * pull
        self._fall += step * (self._fall_speed - 0.5 * step * pull)
        q, m, z = 0.5 * t * t, self._m, moved + self._fall  # as if it did not fall
        n11, n12, n13, n22, n23, n33, b1, b2, b3 = self._sums
        self._sums = (
            *(n11 + 1.0, n12 + q, n13 + m, n22 + q * q, n23 + q * m, n33 + m * m),
            *(b1 + z, b2 + q * z, b3 + m * z),
        )
        if abs(moved) >= self.farthest:
            self.farthest, self._out = abs(moved), self._sums

    def gain(self) -> tuple[float, float]:
        """Return the motor's gain and its standard deviation, (rad/s2)/V.

        Columns are 1, t^2 / 2 and the way that a gain of 1 gives. The matrix is symmetric: what the first two
        explain is taken out of the third one. What is too large for sums leaves what was expected before.
        """
        n11, n12, n13, n22, n23, n33, b1, b2, b3 = self._out
        counts = _NOISE_COUNTS * self._count
        variance = counts * counts + _NOISE_MIN_RAD * _NOISE_MIN_RAD
        first, usual = max(_NOISE_MIN_RAD, self._count), _MOTOR_GAIN_RATIO_MAX * self._ku
        n11 += variance / (first * first)
        n22 += variance / (_DISTURBANCE_RAD_S2 * _DISTURBANCE_RAD_S2)
        n33 += variance / (usual * usual)
        l2, l3 = n12 / n11, n13 / n11
        d22, d23, d33 = n22 - l2 * n12, n23 - l2 * n13, n33 - l3 * n13
        share = d23 / d22  # d22 is positive, or no number: n11 is more than the number of samples
        d = d33 - share * d23
        if not d > 0.0:
            return 0.0, usual
        return ((b3 - l3 * b1) - share * (b2 - l2 * b1)) / d, math.sqrt(variance / d)
