"""A block: consecutive cycles as columns, and the reference at each sample's own instant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.control.model import UNKNOWN_MODEL
from dcmp_hil.ipc.ring import FIELDS, NO_REFERENCE

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from dcmp_hil.control.model import Model
    from dcmp_hil.values import Reference

_COLUMN = {name: index for index, name in enumerate(FIELDS)}
_REFERENCE_COLUMNS = slice(_COLUMN["position_reference"], _COLUMN["acceleration_reference"] + 1)
_SAME_INSTANT_SHARE = 0.02  # of the delay: instants that differ by less are one


class Block:
    """`n` consecutive cycles.

    Parameters
    ----------
    rows
        Shape (n, len(FIELDS) + len(further)), as `Ring.drain` gives them.
    model
        What the host believes of the plant.
    further
        Names of the columns behind `FIELDS`.
    """

    def __init__(
        self, rows: NDArray[np.float64], model: Model = UNKNOWN_MODEL, further: tuple[str, ...] = ()
    ) -> None:
        self.rows, self.model, self.further = rows, model, further

    def with_rows(self, rows: NDArray[np.float64]) -> Block:
        """Return a block of other cycles of the same run."""
        return Block(rows, self.model, self.further)

    def __len__(self) -> int:
        """Count the periods."""
        return len(self.rows)

    def __getitem__(self, field: str) -> NDArray[np.float64]:
        """Return one column of `FIELDS`, or a further one, shape (n,), SI units."""
        number = _COLUMN.get(field)
        if number is None:
            number = len(FIELDS) + self.further.index(field)
        column: NDArray[np.float64] = self.rows[:, number]
        return column

    @property
    def reference(self) -> NDArray[np.float64]:
        """Position rad, velocity rad/s and acceleration rad/s2 at each row's own `t`, shape (n, 3)."""
        return self.rows[:, _REFERENCE_COLUMNS]

    @property
    def gravity(self) -> NDArray[np.float64]:
        """Return what of the disturbance is gravity by the model, -(gmL/J) sin x1_hat, rad/s2, shape (n,)."""
        gravity: NDArray[np.float64] = -self.model.gravity * np.sin(self["position_estimate"])
        return gravity

    @property
    def friction(self) -> NDArray[np.float64]:
        """Return what of it is Coulomb friction by the model, -f1 sgn x2_hat, rad/s2, shape (n,)."""
        friction: NDArray[np.float64] = -self.model.f1 * np.sign(self["velocity_estimate"])
        return friction

    @property
    def tracking_error(self) -> NDArray[np.float64]:
        """Position minus reference at the same instant, rad: the true position where it is known.

        NaN before the trajectory began: the probe moves the arm, and there is nothing to track.
        """
        true = self["position_true"]
        position = np.where(np.isnan(true), self["position"], true)
        error: NDArray[np.float64] = position - self["position_reference"]
        error[self["t"] < self["began"]] = np.nan
        return error


class ReferenceAligner:
    """Finds the reference at each sample's own instant, period by period.

    A cycle holds the reference at t + delay; the one at t is that of the cycle `delay` earlier. Where
    that cycle is missing (the first ones, lost samples) the trajectory is asked.

    Parameters
    ----------
    at
        The trajectory.
    delay
        s, from a sample to the instant at which its command takes effect: 0 or one period.
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
        self._delay = delay
        self._off = _SAME_INSTANT_SHARE * delay
        self._began = began
        self._since = began()
        self._due = math.nan  # the instant that the cycle before looked ahead to
        self._then = NO_REFERENCE

    def now(self, t: float, ahead: Reference) -> tuple[Reference, float]:
        """Return the reference at device time `t`, and when the trajectory began.

        Parameters
        ----------
        t
            s, of the sample after that of the call before.
        ahead
            The reference at t + delay.
        """
        began, delay = self._since, self._delay
        jumps = False
        if began == math.inf and (began := self._began()) != math.inf:  # it begins once
            self._since, jumps = began, True  # to where the arm is
        if delay == 0.0:
            return ahead, began
        at_t = self._at(t) if jumps or not -self._off < t - self._due < self._off else self._then
        self._due, self._then = t + delay, ahead
        return at_t, began
