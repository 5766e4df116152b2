"""A block: consecutive periods as columns, and the reference at each sample's own instant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.telemetry.ring import FIELDS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from dcmp_hil.values import Reference

_COLUMN = {name: index for index, name in enumerate(FIELDS)}
_T = _COLUMN["t"]
_AHEAD = [_COLUMN[name] for name in ("position_ahead", "velocity_ahead", "acceleration_ahead")]


class Block:
    """`n` consecutive periods.

    Parameters
    ----------
    rows
        Shape (n, len(FIELDS)), as `Ring.drain` gives them.
    reference
        Shape (n, 3): position rad, velocity rad/s and acceleration rad/s2 at each row's own `t`.
    began
        s, device time at which the trajectory began.
    """

    def __init__(
        self, rows: NDArray[np.float64], reference: NDArray[np.float64], began: float = -math.inf
    ) -> None:
        self.rows = rows
        self.reference = reference
        self._began = began

    def __len__(self) -> int:
        """Count the periods."""
        return len(self.rows)

    def __getitem__(self, field: str) -> NDArray[np.float64]:
        """Return one column of `FIELDS`, shape (n,), SI units."""
        column: NDArray[np.float64] = self.rows[:, _COLUMN[field]]
        return column

    @property
    def tracking_error(self) -> NDArray[np.float64]:
        """Position minus reference at the same instant, rad: the true position where it is known.

        NaN before the trajectory began: the probe moves the arm, and there is nothing to track.
        """
        true = self["position_true"]
        position = np.where(np.isnan(true), self["position"], true)
        error: NDArray[np.float64] = position - self.reference[:, 0]
        error[self["t"] < self._began] = np.nan
        return error


class Aligner:
    """Finds the reference at each sample's own instant.

    A cycle holds the reference at t + delay; the one at t is that of the cycle `delay` earlier. Where
    that cycle is missing (the first ones, lost samples) the trajectory is asked.

    Parameters
    ----------
    at
        The trajectory.
    delay
        s, from a sample to the instant at which its command takes effect.
    began
        When the trajectory began, s; infinity before it did.
    """

    def __init__(
        self,
        at: Callable[[float], Reference],
        delay: float,
        began: Callable[[], float] = lambda: -math.inf,
    ) -> None:
        self._at = at
        self._began = began
        self._delay = delay
        self._last = np.full((1, len(FIELDS)), np.nan)

    def block(self, rows: NDArray[np.float64]) -> Block:
        """Make a block of rows that follow those of the call before.

        The delay is 0 or one period, so the row before, or the row itself, is the one wanted.
        """
        began = self._began()
        if self._delay == 0.0:
            return Block(rows, rows[:, _AHEAD], began)
        earlier = np.concatenate((self._last, rows[:-1]))
        reference = earlier[:, _AHEAD]
        missed = ~(np.abs(earlier[:, _T] + self._delay - rows[:, _T]) < 0.02 * self._delay)
        missed |= (earlier[:, _T] < began) & (rows[:, _T] >= began)  # there it jumps to where the arm is
        for k in np.flatnonzero(missed):
            reference[k] = self._at(float(rows[k, _T]))
        if len(rows):
            self._last = rows[-1:].copy()
        return Block(rows, reference, began)
