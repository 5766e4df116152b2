"""The plant port of the native board, as firmware/boards/native/plant_port.h describes it."""

from __future__ import annotations

from struct import Struct
from typing import NamedTuple

TICK = Struct("<IIHBx")
"""now_us, counts, wait_ms, flags."""
OUTPUT = Struct("<IIIhBBHBB")
"""The fields of Output."""
PLANT_TIME_FLAG = 1  # flag of TICK: the board's clock stands still until the next one
_UNASKED_FLAG, _LINK_UP_FLAG = 1, 2  # flags of OUTPUT


class Output(NamedTuple):
    """Output of the firmware to the plant."""

    now_us: int  # by the firmware's clock
    since_us: int  # when the output became what it is
    fed_us: int  # when the watchdog was fed for the last time
    voltage_mV: int
    enable: int
    state: int
    owner: int
    fault: int
    flags: int

    @property
    def unasked(self) -> bool:
        """Whether the output changed between two ticks."""
        return self.flags & _UNASKED_FLAG != 0

    @property
    def link_up(self) -> bool:
        """Whether a host has the port open."""
        return self.flags & _LINK_UP_FLAG != 0
