"""The polarity probe: a volt up, a volt down, before engaging: which way does the arm go, and how far."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.errors import TripError

if TYPE_CHECKING:
    from numpy.typing import NDArray

WATCH = 0.1  # s at 0 V: is the arm at rest
PUSH = 0.1  # s each way at most
_REST = 0.02  # rad, that the arm may move while it is watched
_FAR = 0.03  # rad, at which a push ends early: the whole probe stays within 0.1 rad
_SPREAD = 3.0  # measured over believed motor gain, either way
_SURE = 4.0  # standard deviations
_NOISE, _LEAST = 0.4, 1e-4  # counts and rad, of a position
_PUSHED, _STRONGEST = 2.0, 3.0  # rad/s2, what may push besides; times the believed motor gain
_TELLING = 2.0  # counts that a push must be expected to move the arm by


class Probe:
    """Moves the arm by a few hundredths of a radian and compares with what `[model]` says.

    The second push lasts as long as the first. Until the arm turns round, friction, gravity and a constant
    push add up to a constant acceleration, and so the motor's gain is what the two directions of the voltage
    tell apart: least squares over every sample, which is finer than a count.

    Parameters
    ----------
    ku
        (rad/s2)/V, the believed motor gain ku/J.
    voltage
        V, of a push.
    count
        rad, one count of the encoder; 0 for an ideal one.
    """

    def __init__(self, ku: float, voltage: float, count: float) -> None:
        self._ku, self._voltage, self._count = ku, voltage, count
        self._began = math.nan  # s, of the present stage
        self._x0 = math.nan  # rad, where the arm was as the stage of watching, and then the pushes, began
        self._seen: list[tuple[float, float]] = []  # s and rad since the pushes began
        self._length = math.nan  # s, of the first push
        self._stage = self._watch

    @property
    def telling(self) -> bool:
        """Whether the encoder is fine enough for the probe to say anything."""
        return 0.5 * self._ku * self._voltage * PUSH * PUSH > _TELLING * self._count

    def voltage_at(self, t: float, position: float) -> float | None:
        """Return the voltage for this period, V; None when the probe is over and all is well.

        Raises
        ------
        TripError
            ``moving``, ``power``, ``polarity`` or ``gain``: the rig is not what the file says.
        """
        if math.isnan(self._began):
            self._began, self._x0 = t, position
        return self._stage(t - self._began, t, position)

    def _watch(self, since: float, t: float, position: float) -> float | None:
        if not -_REST <= position - self._x0 <= _REST:
            raise TripError(
                "moving",
                f"The arm moves by itself: {position - self._x0:+.3f} rad in {since:.3f} s at 0 V.",
                'Bring it to rest, hanging, and start again; supervisor.probe = "off" starts without it.',
            )
        if since < WATCH:
            return 0.0
        return self._begin(self._push_up, t, position, self._voltage)

    def _push_up(self, since: float, t: float, position: float) -> float | None:
        self._seen.append((since, position))
        if since < PUSH and abs(position - self._x0) < _FAR:
            return self._voltage
        self._length, self._began = since, t
        self._stage = self._push_down
        return -self._voltage

    def _push_down(self, since: float, t: float, position: float) -> float | None:  # noqa: ARG002
        self._seen.append((self._length + since, position))
        if since < self._length:
            return -self._voltage
        self._judge(np.array(self._seen).T)
        return None

    def _begin(self, stage: object, t: float, position: float, voltage: float) -> float:
        self._began, self._x0 = t, position
        self._seen = [(0.0, position)]
        self._stage = stage  # type: ignore[assignment]
        return voltage

    def _judge(self, seen: NDArray[np.float64]) -> None:
        """Compare the measured motor gain with the believed one; an encoder's step is given the benefit."""
        moved = seen[1] - self._x0
        up, farthest = moved[np.searchsorted(seen[0], self._length)], float(np.abs(moved).max())
        gain, deviation = self._gain(seen[0], moved)
        unsure = _SURE * deviation
        volts, down = f"{self._voltage:g} V", moved[-1] - up
        said = f"+{volts} moved the arm by {up:+.4f} rad, -{volts} by {down:+.4f} rad"
        if not farthest > self._count:
            raise TripError(
                "power",
                f"The arm does not answer: {said}.",
                "Look at motor supply, e-stop and ENABLE, at the coupling, and at the encoder's cable.",
            )
        if not gain + unsure > 0.0:
            raise TripError(
                "polarity",
                f"The arm goes the wrong way: {said}.",
                "Change amplifier.sign, or encoder.sign if the count falls when you lift the arm by hand.",
            )
        if not gain - unsure > 0.0:
            raise TripError(
                "power",
                f"The arm hardly answers, too little to tell which way: {said}.",
                'Look what holds it, and at the motor supply; supervisor.probe = "off" starts without.',
            )
        if not (gain + unsure > self._ku / _SPREAD and gain - unsure < self._ku * _SPREAD):
            raise TripError(
                "gain",
                f"The arm answers {gain / self._ku:.2g} times as strongly as [model] says: {said}.",
                "Look at encoder.counts_per_rev (after quadrature), at the gear, and at model.ku_rad_s2_V.",
            )

    def _gain(self, t: NDArray[np.float64], moved: NDArray[np.float64]) -> tuple[float, float]:
        """Fit the motor's gain and a constant push to the way out: until it turns, friction is constant."""
        out = int(np.flatnonzero(np.abs(moved) == np.abs(moved).max())[-1]) + 1
        t, moved = t[:out], moved[:out]
        late = np.maximum(t - self._length, 0.0)
        columns = np.column_stack([np.ones_like(t), 0.5 * t * t, 0.5 * t * t - late * late])
        noise = math.hypot(_NOISE * self._count, _LEAST)
        usual = np.array([max(self._count, _LEAST), _PUSHED, _STRONGEST * self._ku * self._voltage])
        covariance = np.linalg.inv(columns.T @ columns / noise**2 + np.diag(usual**-2))
        gain = (covariance @ columns.T @ moved)[2] / noise**2
        return float(gain / self._voltage), float(np.sqrt(covariance[2, 2]) / self._voltage)
