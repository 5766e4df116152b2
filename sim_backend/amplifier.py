"""The amplifier: commanded to applied voltage, and the delay in between."""

from __future__ import annotations

import math
from collections import deque

from dcmp_hil.control.elementary import nearest


class Amplifier:
    """Clamp, slew limit, dead zone and quantiser, behind a delay of whole periods.

    Parameters
    ----------
    limit
        V, either way; infinity for none.
    slew
        V a period; infinity for none.
    dead_zone
        V, either way: a smaller output is none.
    quantum
        V, the output's step; 0 for none.
    delay_samples
        Periods from command to output.
    """

    def __init__(
        self, *, limit: float, slew: float, dead_zone: float, quantum: float, delay_samples: int
    ) -> None:
        self._limit, self._slew = limit, slew
        self._dead_zone, self._quantum = dead_zone, quantum
        self._plain = math.isinf(slew) and dead_zone == 0.0 and quantum == 0.0
        self._newest = 0.0
        self._waiting = deque([0.0] * delay_samples)
        self._ramp = 0.0  # V, the slewed command
        self.live = False

    def command(self, voltage: float) -> None:
        """Set the newest command, V; a number that is not finite counts as 0 V."""
        self._newest = voltage if math.isfinite(voltage) else 0.0

    def release(self) -> None:
        """Go to 0 V at once and stay there."""
        self.live = False
        self._newest = self._ramp = 0.0
        self._waiting = deque([0.0] * len(self._waiting))

    def step(self) -> float:
        """Return the voltage applied over the next period, V; the newest command is held."""
        if not self.live:
            return 0.0
        self._waiting.append(self._newest)
        wanted = self._waiting.popleft()
        limit = self._limit
        wanted = limit if wanted > limit else max(wanted, -limit)
        return wanted if self._plain else self._shaped(wanted)

    def _shaped(self, wanted: float) -> float:
        # The ramp goes on underneath quantiser and dead zone, or a slow one would never leave them.
        self._ramp = output = max(self._ramp - self._slew, min(self._ramp + self._slew, wanted))
        if self._quantum:
            output = self._quantum * nearest(output / self._quantum)
            if abs(output) > self._limit:
                output -= math.copysign(self._quantum, output)
        return 0.0 if abs(output) < self._dead_zone else output
