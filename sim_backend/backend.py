"""The simulated rig as a backend: virtual time, paced by the clock it is given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.errors import LinkError
from dcmp_hil.values import Fault, Sample
from sim_backend.engine import engine_of
from sim_backend.hardware import make_hardware, why_not_core
from sim_backend.pacer import Pacer
from sim_backend.plant_fault_hooks import HEALTHY

if TYPE_CHECKING:
    from types import TracebackType

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.values import Truth
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

    Attributes
    ----------
    remarks
        What a user should know of it.
    why_not_core
        Why the core does not have this rig as a whole, in a sentence; empty if it does.
    """

    simulated = True

    def __init__(self, rig: Rig, clock: Clock, faults: PlantFaults = HEALTHY) -> None:
        self._pace = Pacer(clock, rig.period)
        self._period = rig.period
        self._skips = rig.timing.overrun == "skip"
        engine = engine_of(rig)
        self.remarks = engine.remarks
        self._hardware = make_hardware(rig, engine, faults)
        self.why_not_core = why_not_core(rig, engine, faults)
        self._live = False

    def __enter__(self) -> Self:
        """Switch the amplifier on, at 0 V."""
        self._live = True
        self._pace.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Go to 0 V and stay there."""
        self._live = False
        self._hardware.release()

    def read(self) -> Sample:
        """Advance the plant to the next tick and return what its encoder shows.

        Under `timing.overrun = "skip"` that is the newest tick that is due, like a device's newest sample.

        Raises
        ------
        LinkError
            If the backend is not open.
        """
        if not self._live:
            raise LinkError("The simulated rig is closed. Use it as a context manager: with backend: ...")
        tick, position, voltage = self._hardware.sample()
        if self._skips and (missed := self._pace.missed(tick)):
            for _ in range(missed):
                self._hardware.advance()
            tick += missed
            position, voltage = self._hardware.read()
        self._pace.wait_for(tick)
        return make(Sample, (tick * self._period, position, voltage, _NO_FAULT))  # 0.09 us less

    def write(self, voltage: float) -> None:
        """Send a voltage to the amplifier, V."""
        if self._live:
            self._hardware.command(voltage)

    def truth(self) -> Truth:
        """Return the true state at the last sample."""
        return self._hardware.truth()

    @property
    def live(self) -> bool:
        """Whether the amplifier is on; off, it puts out 0 V in any case."""
        return self._live
