"""Ends of a plot's axis: where Rerun writes at least three numbers beside it.

Rerun writes a number at every multiple of 10^k for which there are 22 pixels, so that an axis of +-4 in a
plot of 80 pixels has a single number, 0. Two invisible lines, the rails, lead the axis, which is fitted to
all lines, to an end just above 1 x 10^k or a little more.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STEPS = (1.05, 1.5, 1.9)
"""Ends of an axis over 10^k; the last one needs plots of 84 pixels."""
_COARSE_STEPS = (1.05, 1.5)  # for lower plots, down to 70 pixels
_REACH_MIN = 1.05  # below 1 no step has a number
WINDOW_S = 5.0
"""Seconds that a plot shows: on a screen of 1366 a label such as "+1h 12m 40s" has room at each of them."""
_SLOT_S = 1.0  # s


def reach_of(most: float, *, coarse: bool = False) -> float:
    """Return the end of an axis that holds +-`most`: the next of the steps times 10^k, 1.05 at least."""
    if not most > _REACH_MIN:
        return _REACH_MIN
    steps = _COARSE_STEPS if coarse else _STEPS
    decade: float = 10.0 ** math.floor(math.log10(most))
    ends: list[float] = [step * decade for step in (*steps, 10.0 * steps[0])]
    return min(end for end in ends if end >= most)


class Rails:
    """Follows the values of a plot, second by second.

    Parameters
    ----------
    least
        The axis holds this value, too.
    """

    def __init__(self, least: float = 0.0) -> None:
        self._least = least
        self._slot = -1  # the newest second
        self._most: dict[int, float] = {}  # second to the largest value in it
        self._sent = 0.0  # of the newest second
        self.coarse = False

    def reach(self, t: float) -> float:
        """Return the end of the axis that shows the last 5 s before `t`, s."""
        first = math.floor(t - WINDOW_S)
        return self._end(max((most for slot, most in self._most.items() if slot >= first), default=0.0))

    def add(
        self, t: NDArray[np.float64], values: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Take the lines of consecutive cycles.

        A row is due as a second begins, for that and the one before it, and where a second's values grow.

        Parameters
        ----------
        t
            s, shape (n,), n at least 1.
        values
            Shape (n, k); NaN is no value.

        Returns
        -------
        tuple
            Times of the rows that are due, s, shape (m,), and the end of the axis at each, shape (m,).
        """
        first, last = (math.floor(float(one) / _SLOT_S + 1e-6) for one in (t[0], t[-1]))
        size = np.fmax.reduce(np.abs(values), axis=1, initial=0.0)
        rows: list[tuple[float, float]] = []
        if first == last:  # nine of ten blocks of a viewer: it takes a third of the time
            rows += self._grow(first, float(t[0]), float(size.max()))
        else:
            slots = np.floor(t / _SLOT_S + 1e-6)
            starts = np.flatnonzero(np.diff(slots, prepend=slots[0] - 1))
            for start, most in zip(starts.tolist(), np.maximum.reduceat(size, starts).tolist(), strict=True):
                rows += self._grow(int(slots[start]), float(t[start]), most)
        self._most = {slot: most for slot, most in self._most.items() if slot >= self._slot - WINDOW_S - 1}
        table = np.array(rows, dtype=np.float64).reshape(-1, 2)
        return table[:, 0], table[:, 1]

    def _grow(self, slot: int, t: float, most: float) -> list[tuple[float, float]]:
        """Take the largest value of a part of a second that begins at `t`; return the row that is due."""
        self._most[slot] = max(most, self._most.get(slot, 0.0))
        end = self._end(max(self._most[slot], self._most.get(slot - 1, 0.0)))
        if slot == self._slot and end <= self._sent:
            return []
        self._slot, self._sent = slot, end
        return [(t, end)]

    def _end(self, most: float) -> float:
        return reach_of(max(most, self._least), coarse=self.coarse)
