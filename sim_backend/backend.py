"""The simulated rig as a backend: virtual time, paced by the clock it is given."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Self

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.control.counted_random import LOST_SAMPLES, CountedRandom
from dcmp_hil.errors import LinkError
from dcmp_hil.values import Fault, Sample, Truth
from sim_backend.amplifier import Amplifier
from sim_backend.encoder import make_encoder
from sim_backend.pacer import Pacer
from sim_backend.plant import make_plant
from sim_backend.plant_fault_hooks import HEALTHY

if TYPE_CHECKING:
    from types import TracebackType

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from sim_backend.plant_fault_hooks import PlantFaults

_NO_FAULT = Fault.NONE


class SimBackend:
    """Plant, encoder and amplifier behind read and write.

    Under a SimulatedClock a run is as fast as its arithmetic and the same to the bit every time; under a
    MonotonicClock it keeps the pace of the wall.

    Parameters
    ----------
    rig
        Its `[sim]`, `[model]`, `[encoder]`, `[amplifier]` and `[loop]` tables are used.
    clock
        What to sleep on.
    faults
        What goes wrong with plant and encoder.
    """

    simulated = True

    def __init__(self, rig: Rig, clock: Clock, faults: PlantFaults = HEALTHY) -> None:
        self._pace = Pacer(clock, rig.period)
        self._period = rig.period
        self._skips, self._lost = rig.timing.overrun == "skip", rig.sim.lost_samples
        self._has_gaps = self._skips or self._lost > 0.0
        self._tick = 0
        self._chance = CountedRandom(rig.sim.seed, LOST_SAMPLES).uniform
        self._plant = faults.plant(make_plant(rig))
        self._encoder = faults.encoder(make_encoder(rig))
        self._amplifier = Amplifier(
            limit=rig.amplifier.limit,
            slew=rig.amplifier.slew * rig.period,
            dead_zone=rig.sim.dead_zone_V,
            quantum=rig.sim.voltage_step_mV * 1e-3,
            delay_samples=rig.loop.delay_samples,
        )
        self._truth = Truth(rig.sim.position_rad, 0.0, math.nan)

    def __enter__(self) -> Self:
        """Switch the amplifier on, at 0 V."""
        self._amplifier.live = True
        self._pace.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Go to 0 V and stay there."""
        self._amplifier.release()

    def read(self) -> Sample:
        """Advance the plant to the next tick and return what its encoder shows.

        Under `timing.overrun = "skip"` that is the newest tick that is due, like a device's newest sample.

        Raises
        ------
        LinkError
            If the backend is not open.
        """
        if not self._amplifier.live:
            raise LinkError("The simulated rig is closed. Use it as a context manager: with backend: ...")
        voltage, tick = 0.0, self._tick
        if tick:
            voltage = self._amplifier.step()
            self._truth = self._plant.advance(voltage)
            if self._has_gaps:
                voltage, tick = self._after_gap(voltage, tick)
        self._tick = tick + 1
        self._pace.wait_for(tick)
        position = self._encoder.read(self._truth.position)
        return make(Sample, (tick * self._period, position, voltage, _NO_FAULT))  # 0.09 us less

    def _after_gap(self, voltage: float, tick: int) -> tuple[float, int]:
        """Simulate periods without a sample; return the voltage of the last one, V, and its tick.

        They are those whose samples are lost, and then those that are due already and skipped.
        """
        while self._chance(tick) < self._lost:
            voltage, tick = self._advance(), tick + 1
        for _ in range(self._pace.missed(tick) if self._skips else 0):
            voltage, tick = self._advance(), tick + 1
        return voltage, tick

    def _advance(self) -> float:
        """Simulate one period, and return the voltage applied over it, V."""
        voltage = self._amplifier.step()
        self._truth = self._plant.advance(voltage)
        return voltage

    def write(self, voltage: float) -> None:
        """Send a voltage to the amplifier, V."""
        self._amplifier.command(voltage)

    def truth(self) -> Truth:
        """Return the true state at the last sample."""
        return self._truth

    @property
    def live(self) -> bool:
        """Whether the amplifier is on; off, it puts out 0 V in any case."""
        return self._amplifier.live
