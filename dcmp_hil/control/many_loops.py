"""Stability and noise of many linear loops at once: a screen that is sure where it says yes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.control.controllers import Gains
from dcmp_hil.control.model import Model
from dcmp_hil.control.stability import NOISE, SENT, STATE_COUNT, UNMODELLED_RATIO, LinearLoop

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from dcmp_hil.control.stability import LoopSpec

_DOUBLINGS = 14  # as `LinearLoop.noise_V` looks back
_NORM_MAX = 0.5  # of the power that is looked at: below 1 no eigenvalue is above 1


class ManyLoops(LinearLoop):
    """Loops with the same period, delay and measured position, whose other numbers are columns.

    Parameters
    ----------
    loops
        One or more; each equation of `LinearLoop` then holds for all of them, shape (n, 1).
    """

    def __init__(self, loops: Sequence[LinearLoop]) -> None:
        numbers = [loop.numbers for loop in loops]
        spec = loops[0].spec
        model = Model(*_columns([loop.spec.model for loop in loops]))
        self._count = len(loops)
        self._spec: LoopSpec = spec._replace(model=model)
        self._resolutions = np.array([loop.spec.resolution for loop in loops])
        self._gains = Gains(*_columns([one.gains for one in numbers]))
        self._tuning = numbers[0].tuning._replace(
            L1=_columns([(one.tuning.L1,) for one in numbers])[0],
            L2=_columns([(one.tuning.L2,) for one in numbers])[0],
        )
        self._copy = type(numbers[0].copy)(*_columns([one.copy for one in numbers]))
        self._correction = _columns([one.correction for one in numbers])
        self._held = _columns([one.held for one in numbers])

    def matrices(self, motor: float) -> NDArray[np.float64]:
        """Return what one period does to the state of each loop, shape (n, states, states)."""
        states = np.broadcast_to(np.eye(STATE_COUNT)[:, None], (STATE_COUNT, self._count, STATE_COUNT))
        return np.ascontiguousarray(np.moveaxis(self._period(states, motor), 1, 0))

    @np.errstate(all="ignore")  # what overflows is not sure to be stable
    def surely_stable(self, motor: float) -> NDArray[np.bool_]:
        """Return for each loop whether it is stable beyond doubt: some power of its matrix is small."""
        power = self.matrices(motor)[:, :NOISE, :NOISE]
        for _ in range(_DOUBLINGS):
            power = power @ power
        small: NDArray[np.bool_] = np.abs(power).sum(axis=2).max(axis=1) < _NORM_MAX
        return small

    @np.errstate(all="ignore")
    def noise(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return `noise_V` and `variation_V_s` of each loop, V and V/s, up to rounding; NaN where none is."""
        matrix = self.matrices(1.0)
        loop, drive = matrix[:, :NOISE, :NOISE], matrix[:, :NOISE, NOISE]
        power, spread = loop.copy(), drive[:, :, None] * drive[:, None, :]
        for _ in range(_DOUBLINGS):
            spread = spread + power @ spread @ power.transpose(0, 2, 1)
            power = power @ power
        row = loop[:, SENT]
        now = spread[:, SENT, SENT]
        ahead = np.einsum("ni,nij,nj->n", row, spread, row) + drive[:, SENT] ** 2
        change = ahead + now - 2.0 * np.einsum("ni,ni->n", row, spread[:, :, SENT])
        unit = self._resolutions / math.sqrt(12.0)
        step = UNMODELLED_RATIO * math.sqrt(2.0 / math.pi) / self._spec.period
        return unit * np.sqrt(np.maximum(0.0, now)), step * unit * np.sqrt(np.maximum(0.0, change))


def _columns(rows: Sequence[Sequence[float]]) -> Any:
    """Return the columns of a table of numbers, each as an array of shape (n, 1)."""
    return tuple(np.array(rows, np.float64).T[:, :, None])
