"""A condition of each cycle, reduced to the cycles in which it changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class TransitionDetector:
    """Remembers the last answer from block to block."""

    def __init__(self) -> None:
        self._last: bool | None = None

    def changes(self, truth: NDArray[np.bool_]) -> NDArray[np.intp]:
        """Return the rows of `truth`, shape (n,), that differ from the row before; the very first does."""
        before = np.concatenate((truth[:1] if self._last is None else [self._last], truth[:-1]))
        changed = truth != before
        changed[0] |= self._last is None
        self._last = bool(truth[-1])
        return np.flatnonzero(changed)
