"""Base of the faults of plant and encoder, and the two with their faults."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from dcmp_hil.values import UNKNOWN_TRUTH
from sim_backend.encoder import Encoder
from sim_backend.faults.fault_model import FaultModel

if TYPE_CHECKING:
    from dcmp_hil.values import Truth
    from sim_backend.plant import Plant


class PlantFault(FaultModel):
    """Between the amplifier's output and the motor, and between the shaft and the counter."""

    def voltage(self, volts: float) -> float:
        """Return what the motor sees, V; an acceleration is that many volts."""
        return volts

    def count(self, counts: float) -> float:
        """Return what the counter shows; asked in every period, in which it is on."""
        return counts


class Acting(Protocol):
    """Protocol of a source of active plant faults."""

    @property
    def acting_on_plant(self) -> list[PlantFault]:
        """Return the plant faults that are active."""
        ...

    def tick(self) -> None:
        """Begin a period."""
        ...


class FaultyPlant:
    """A plant behind a faulty amplifier.

    Parameters
    ----------
    plant
        The plant.
    acting
        What goes wrong.
    ticking
        Whether its time is that of the faults.
    """

    def __init__(self, plant: Plant, acting: Acting, *, ticking: bool) -> None:
        self._plant, self._acting, self._ticking = plant, acting, ticking
        self.truth = UNKNOWN_TRUTH

    def advance(self, voltage: float) -> Truth:
        """Hold for a period what becomes of `voltage` (V); w of the truth has the difference."""
        if self._ticking:
            self._acting.tick()
        seen, ku = voltage, 0.0
        for effect in self._acting.acting_on_plant:
            seen, ku = effect.voltage(seen), effect.facts.believed_ku
        truth = self._plant.advance(seen)
        self.truth = truth._replace(disturbance=truth.disturbance + ku * (seen - voltage))
        return self.truth

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        self._plant.stretch(factor)


class FaultyEncoder(Encoder):
    """An encoder whose count something happens to.

    Parameters
    ----------
    encoder
        The encoder.
    acting
        What goes wrong.
    """

    def __init__(self, encoder: Encoder, acting: Acting) -> None:
        self._encoder, self._acting = encoder, acting

    def read(self, position: float) -> float:
        """Return the measured position, rad."""
        measured = self._encoder.read(position)
        for effect in self._acting.acting_on_plant:
            measured = effect.facts.count_rad * effect.count(measured / effect.facts.count_rad)
        return measured

    def count(self, position: float) -> int:
        """Return the counter at a position (rad)."""
        count: float = self._encoder.count(position)
        for effect in self._acting.acting_on_plant:
            count = effect.count(count)
        return round(count)
