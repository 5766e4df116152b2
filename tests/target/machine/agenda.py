"""What will happen, in order of time, and of asking where the time is the same."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class Agenda:
    """Queue of future calls, in the order of time."""

    def __init__(self) -> None:
        self.next_us = math.inf
        self._deeds: list[tuple[float, int, Callable[[], object]]] = []
        self._asked = 0

    def add(self, at_us: float, deed: Callable[[], object]) -> None:
        """Have something happen then."""
        self._asked += 1
        heapq.heappush(self._deeds, (at_us, self._asked, deed))
        self.next_us = self._deeds[0][0]

    def take(self) -> Callable[[], object]:
        """Remove the next call from the queue, and return it."""
        deed = heapq.heappop(self._deeds)[2]
        self.next_us = self._deeds[0][0] if self._deeds else math.inf
        return deed
