"""Why the arm does not answer the voltage as the model says, told from a few hundredths of a second."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from dcmp_hil.values import Sample

_WINDOW = 60e-3  # s
_FEWEST = 12  # samples that say anything
_HALF = 0.5  # between a motor that answers (1), a dead one (0) and a reversed one (-1)


class Finding(NamedTuple):
    """A cause, by name and in words."""

    reason: str
    sentence: str
    remedy: str


_STUCK = Finding(
    "stuck",
    "The encoder shows the same position all the time",
    "Look at the encoder's cable, supply and coupling.",
)
_POWER = Finding(
    "power",
    "The arm moves as if the motor had no current",
    "Look at motor supply, e-stop, ENABLE and fuse.",
)
_POLARITY = Finding(
    "polarity",
    "The motor pushes the arm the wrong way",
    "Look at the polarity of motor and encoder: amplifier.sign, encoder.sign.",
)
_OTHER = Finding(
    "disturbance",
    "Something pushes the arm that the model does not know",
    "Look for an obstacle, at the load and [model], and that the voltage fed back is the one really applied.",
)


class Diagnosis:
    """Remembers what was measured, and says on demand what that looks like.

    Over a window so short that gravity and friction are constant, the position is a parabola plus g times
    what the voltages did by the model. Least squares give g: 1 for a motor that answers, 0 for a dead one,
    -1 for a reversed one.

    Parameters
    ----------
    ku
        (rad/s2)/V, the believed motor gain ku/J.
    period
        s.
    """

    def __init__(self, ku: float, period: float) -> None:
        self._ku = ku
        self._seen: deque[Sample] = deque(maxlen=max(_FEWEST, round(_WINDOW / period)))
        self.add = self._seen.append
        """Remember a sample; called every period, so there is no function around it."""

    def finding(self) -> Finding:
        """Say what the last samples look like."""
        if len(self._seen) < _FEWEST:
            return _OTHER
        t, position, voltage, _ = np.array(self._seen, float).T
        if not np.isfinite(position).all():
            return _OTHER
        if np.ptp(position) == 0.0:
            return _STUCK
        gain = self._gain(t - t[0], position, voltage)
        if gain < -_HALF:
            return _POLARITY
        return _POWER if gain < _HALF else _OTHER

    def _gain(self, t: np.ndarray, position: np.ndarray, voltage: np.ndarray) -> float:
        """Fit the parabola and g; columns are scaled so that rounding does not decide."""
        step = np.diff(t, prepend=t[0])
        velocity = np.cumsum(step * voltage)
        moved = self._ku * np.cumsum(step * (velocity - 0.5 * step * voltage))
        columns = np.column_stack([np.ones_like(t), t, t * t, moved])
        scale = np.abs(columns).max(axis=0)
        scale[scale == 0.0] = 1.0
        solution = np.linalg.lstsq(columns / scale, position, rcond=None)[0] / scale
        return float(solution[3])
