"""References: position, velocity and acceleration as functions of the trajectory's own time."""

from abc import ABC, abstractmethod
from typing import Annotated, Protocol

from pydantic import Field

from dcmp_hil.common.section import Section
from dcmp_hil.values import Reference


class ReferenceSource(Protocol):
    """Protocol of a reference: time in, position, velocity and acceleration out."""

    def at(self, t: float) -> Reference:
        """Return where the arm should be `t` seconds after the start."""
        ...


class ReferenceSettings(Section, ABC):
    """The settings that every kind of `[reference]` has."""

    soft_start_s: Annotated[float, Field(ge=0, le=60)] = 2.0
    """Time in which the reference fades in from the arm's position, s; 0 = at once."""

    @abstractmethod
    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""

    def source(self) -> ReferenceSource:
        """Return what the loop evaluates in every cycle; its values are those of `at`, to the bit."""
        return self


__all__ = ["ReferenceSettings", "ReferenceSource"]
