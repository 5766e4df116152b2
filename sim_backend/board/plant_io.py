"""Connections of a board's pins: the plant's encoder, and the amplifier's power stage."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.values import Truth
from sim_backend.amplifier import Amplifier
from sim_backend.encoder import make_encoder
from sim_backend.engine import engine_of
from sim_backend.plant import make_plant

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from sim_backend.plant_fault_hooks import PlantFaults

_UINT32_MAX = 0xFFFF_FFFF


class PlantIO:
    """The plant, wired as the rig says: a positive command may lower the arm, a rising arm count down.

    Parameters
    ----------
    rig
        Its `[sim]`, `[model]`, `[encoder]` and `[amplifier]` tables.
    count_offset
        Counts, what the encoder shows at 0 rad.
    """

    def __init__(self, rig: Rig, count_offset: int = 0) -> None:
        engine = engine_of(rig)
        self.remarks = engine.remarks
        self._plant = make_plant(rig, engine)
        self._encoder = make_encoder(rig)
        self._healthy = self._plant, self._encoder
        self._stage = _power_stage(rig)
        self._mV_per_V = rig.amplifier.sign * 1e3
        self._encoder_sign = rig.encoder.sign
        self._offset = count_offset
        self.truth = Truth(rig.sim.position_rad, 0.0, math.nan)

    def advance(self, voltage_mV: int) -> None:
        """Hold what the firmware puts out, mV, for a period."""
        voltage = voltage_mV / self._mV_per_V
        if self._stage is not None:
            self._stage.command(voltage)
            voltage = self._stage.step()
        self.truth = self._plant.advance(voltage)

    def inject(self, faults: PlantFaults) -> None:
        """Inject faults between the pins and the plant, in place of earlier ones."""
        plant, encoder = self._healthy
        self._plant, self._encoder = faults.plant(plant), faults.encoder(encoder)

    def stretch(self, factor: float) -> None:
        """Make the board's period `factor` times as long."""
        self._plant.stretch(factor)

    def count(self) -> int:
        """Return the encoder's counter, 32 bits."""
        return (self._encoder_sign * self._encoder.count(self.truth.position) + self._offset) & _UINT32_MAX


def _power_stage(rig: Rig) -> Amplifier | None:
    """Return what shapes the voltage beyond the board, if anything; clamp and slew are the firmware's."""
    sim = rig.sim
    if sim.dead_zone_V == 0.0 and sim.voltage_step_mV == 0.0:
        return None
    stage = Amplifier(
        limit=math.inf,
        slew=math.inf,
        dead_zone=sim.dead_zone_V,
        quantum=sim.voltage_step_mV * 1e-3,
        delay_samples=0,
    )
    stage.live = True
    return stage
