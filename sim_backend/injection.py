"""Where faults come between the parts of a simulated rig; by default nothing does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from sim_backend.encoder import Encoder
    from sim_backend.plant import Plant


class PlantFaults(Protocol):
    """What goes wrong at the plant."""

    def plant(self, plant: Plant) -> Plant:
        """Return the plant with its faults around it."""
        ...

    def encoder(self, encoder: Encoder) -> Encoder:
        """Return the encoder with its faults around it."""
        ...


class _Healthy:
    """Plant and encoder are as they were made."""

    @staticmethod
    def plant(plant: Plant) -> Plant:
        return plant

    @staticmethod
    def encoder(encoder: Encoder) -> Encoder:
        return encoder


HEALTHY: PlantFaults = _Healthy()
