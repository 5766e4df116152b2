"""The encoder and its limits as docs/protocol.md alone describes them."""

from __future__ import annotations

import statistics
from collections import deque
from typing import TYPE_CHECKING

from tests.contract.reference_wire import ENCODER_JUMP, OVER_SPEED, OVER_TRAVEL

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


def _shortest(change: int) -> int:
    return (change + (1 << 23)) % (1 << 24) - (1 << 23)


class Motion:
    """The encoder's count, without jumps and wrong counts, and its limits."""

    def __init__(self, period_us: int) -> None:
        self.raw: int | None = None
        self._raws: deque[int] = deque(maxlen=3)
        self._period_us = period_us
        self._periods = -(-1000 // period_us)
        self._long = -(-8000 // period_us)
        kept = max(2 * self._periods, self._long) + 3
        self._counts: deque[int] = deque([0] * kept, maxlen=kept)  # the oldest first; at rest before boot
        self._zero: int | None = None
        self._jumps: deque[int] = deque(maxlen=3)
        self._now = 0

    def armed(self) -> None:
        """Note an arming; travel is measured from the first one."""
        self._zero = self._travelled() if self._zero is None else self._zero

    def latch(self, counts: int, tick: int, built_speed: int) -> int:
        """Follow the encoder; return the change if it is a jump, else 0."""
        self._now, jumped_before = tick, tick - 1 in self._jumps
        self.raw = counts & 0xFFFFFF
        older, old = (list(self._raws) or [self.raw])[-2:][0], (self._raws or [self.raw])[-1]
        change, over_two = _shortest(counts - old), _shortest(counts - older)
        self._raws.append(self.raw)
        jump = abs(change) > 8 and abs(change) * 1_000_000 > 4 * built_speed * self._period_us
        if jump:
            self._jumps.append(tick)
        back = abs(over_two) <= 2 + 2 * built_speed * self._period_us / 1_000_000
        if back and (jump or jumped_before):
            self._counts.append(self._counts[-2] + over_two)
        else:
            self._counts.append(self._counts[-1] + (0 if jump else change))
        return change if jump else 0

    def limits(
        self, jump: int, speed_limits: tuple[int, int], travel_limits: Sequence[tuple[int, int]]
    ) -> Iterator[tuple[int, int]]:
        """Yield code and detail of each limit that is exceeded."""
        if jump and len(self._jumps) == 3 and self._now - self._jumps[0] < 100:
            yield ENCODER_JUMP, jump
        built, session = speed_limits
        for periods, more, limit in (
            (self._periods, 1, built), (2 * self._periods, 2, built), (self._long, 1, session),
        ):  # fmt: skip
            moved, span_us = self._moved(periods), periods * self._period_us
            if (abs(moved) - more) * 1_000_000 > limit * span_us:
                yield OVER_SPEED, int(moved * 1_000_000 / span_us)
        for origin, limit in travel_limits:
            travel = self._travelled() - (self._zero or 0) if origin < 0 else self._from(origin)
            if abs(travel) > limit:
                yield OVER_TRAVEL, travel

    def _from(self, origin: int) -> int:
        """Return where the encoder is, counted from an origin the shortest way: the middle one of three."""
        newest = [self._raws[0]] * (3 - len(self._raws)) + list(self._raws)
        return statistics.median_low(_shortest(raw - origin) for raw in newest)

    def _moved(self, periods: int) -> int:
        counts = list(self._counts)
        return statistics.median_low(counts[-k] - counts[-k - periods] for k in (1, 2, 3))

    def _travelled(self) -> int:
        return statistics.median_low(list(self._counts)[-3:])
