"""Whether the SAMPLEs of one node come from one device."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from dcmp_hil.wire.wrapping import unwrap

if TYPE_CHECKING:
    from dcmp_hil.wire.messages import SampleReport

_KEPT_TICKS = 32
_TICKS_MIN = 24
_ODD_TICKS_SHARE_MIN = 0.25  # of the kept: one reset, frames that come twice or late make fewer


class NodeUniqueness:
    """Judges by the ticks in a stream whether two devices have the same node number.

    Ticks of two devices jump forth and back; or one tick comes twice, with different contents.
    """

    def __init__(self) -> None:
        self._last: SampleReport | None = None
        self._odd: deque[bool] = deque(maxlen=_KEPT_TICKS)

    def add(self, sample: SampleReport) -> None:
        """Add the next SAMPLE of the node."""
        last, self._last = self._last, sample
        if last is not None:
            step = unwrap(0, sample.tick - last.tick, 8)
            self._odd.append(step < 0 or (step == 0 and sample != last))

    @property
    def suspicious(self) -> bool:
        """Whether the ticks so far are a reason to listen for longer."""
        return any(self._odd)

    @property
    def two_devices(self) -> bool:
        """Whether the ticks show two devices with the same node number."""
        return len(self._odd) >= _TICKS_MIN and sum(self._odd) >= _ODD_TICKS_SHARE_MIN * len(self._odd)
