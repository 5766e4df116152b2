"""References: position, velocity and acceleration as functions of the trajectory's own time."""

from typing import Annotated, Protocol

from pydantic import Field

from dcmp_hil.common.section import Section
from dcmp_hil.values import Reference


class ReferenceSource(Protocol):
    """Protocol of a reference: time in, position, velocity and acceleration out."""

    def at(self, t: float) -> Reference:
        """Return where the arm should be `t` seconds after the start."""
        ...


class ReferenceSettings(Section):
    """The settings that every kind of `[reference]` has."""

    soft_start_s: Annotated[float, Field(ge=0, le=60)] = 2.0
    """Time in which the reference fades in from the arm's position, s; 0 = at once."""


__all__ = ["ReferenceSettings", "ReferenceSource"]
