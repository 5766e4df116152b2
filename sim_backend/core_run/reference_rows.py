"""The reference of a run, at the instants of its ticks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.control.trajectory import Trajectory
    from dcmp_hil.values import Reference


class ReferenceRows:
    """Makes `struct run_reference` of consecutive ticks.

    Parameters
    ----------
    rig
        Its reference, period and delay.
    row
        Type of the structure.

    Attributes
    ----------
    has_now
        Whether the rows have the reference at each sample's own instant, as where samples are lost.
    has_middle
        Whether they have it between two samples, as where friction is fed forward.
    """

    def __init__(self, rig: Rig, row: np.dtype[np.void]) -> None:
        self._reference, self._at = rig.reference, rig.reference.source().at
        self._period, self._delay = rig.period, rig.delay
        self._row = row
        self.has_now = rig.sim.lost_samples > 0.0
        self.has_middle = rig.controller.feeds_friction_forward

    def of_source(self, ticks: range, began: float) -> NDArray[np.void]:
        """Return the values of the source, for a trajectory that began at `began` (s, device time)."""
        rows = np.zeros(len(ticks), self._row)
        t = np.arange(ticks.start, ticks.stop, dtype=np.float64) * self._period
        ahead = self._reference.at_each(t + self._delay - began)
        rows["x"], rows["v"], rows["a"] = ahead
        if self.has_now:
            rows["x_now"], rows["v_now"], rows["a_now"] = self._reference.at_each(t - began)
        if self.has_middle:
            middle = self._reference.at_each(self._middle(ticks, t) - began)
            rows["x_middle"], rows["v_middle"] = middle.position, middle.velocity
        return rows

    def source(self, since: float) -> Reference:
        """Return the value of the source `since` it began (s)."""
        return self._at(since)

    def of_trajectory(self, ticks: range, trajectory: Trajectory) -> NDArray[np.void]:
        """Return the values of a trajectory; at all of its instants."""
        t = np.arange(ticks.start, ticks.stop, dtype=np.float64) * self._period
        at = trajectory.at
        values = np.array(
            [
                (*at(ahead), *at(now), *at(middle)[:2])
                for ahead, now, middle in zip(
                    (t + self._delay).tolist(), t.tolist(), self._middle(ticks, t).tolist(), strict=True
                )
            ]
        )
        rows = np.zeros(len(ticks), self._row)
        for name, column in zip(self._row.names or (), values.T, strict=True):
            rows[name] = column
        return rows

    def _middle(self, ticks: range, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the instants between each tick and the one before, s."""
        before = np.maximum(np.arange(ticks.start, ticks.stop, dtype=np.float64) - 1.0, 0.0) * self._period
        middle: NDArray[np.float64] = 0.5 * (t + before)
        return middle
