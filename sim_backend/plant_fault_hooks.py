"""Hooks for faults between the parts of a simulated rig; by default they do nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from sim_backend.encoder import Encoder
    from sim_backend.plant import Plant


class PlantFaults(Protocol):
    """Protocol of faults at plant and encoder."""

    def plant(self, plant: Plant) -> Plant:
        """Return the plant, wrapped so that its faults act."""
        ...

    def encoder(self, encoder: Encoder) -> Encoder:
        """Return the encoder, wrapped so that its faults act."""
        ...


class _Healthy:
    """No faults: plant and encoder are returned unchanged."""

    @staticmethod
    def plant(plant: Plant) -> Plant:
        return plant

    @staticmethod
    def encoder(encoder: Encoder) -> Encoder:
        return encoder


HEALTHY: PlantFaults = _Healthy()
