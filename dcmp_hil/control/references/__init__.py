"""References: position, velocity and acceleration as functions of the trajectory's own time."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple, Protocol

import numpy as np
from pydantic import Field

from dcmp_hil.common.section import Section
from dcmp_hil.values import Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

_REFERENCE_POINTS = 2000  # instants at which a reference without peaks of its own is looked at


class Peaks(NamedTuple):
    """The largest of what a reference asks for, either way."""

    position: float  # rad
    velocity: float  # rad/s
    acceleration: float  # rad/s2


class References(NamedTuple):
    """References at n instants, each of shape (n,)."""

    position: "NDArray[np.float64]"  # rad
    velocity: "NDArray[np.float64]"  # rad/s
    acceleration: "NDArray[np.float64]"  # rad/s2


class ReferenceSource(Protocol):
    """Protocol of a reference: time in, position, velocity and acceleration out."""

    def at(self, t: float) -> Reference:
        """Return where the arm should be `t` seconds after the start."""
        ...


class ReferenceSettings(Section, ABC):
    """The settings that every kind of `[reference]` has."""

    in_run: ClassVar[bool] = True
    """Whether a run can change to it; False for what is read from a file before a run."""

    if TYPE_CHECKING:

        @property
        def kind(self) -> str:
            """The word in rig.toml; each kind has a field of this name."""
            ...

    soft_start_s: Annotated[float, Field(ge=0, le=60)] = 2.0
    """Time in which the reference fades in from the arm's position, s; 0 = at once."""

    @abstractmethod
    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""

    def source(self) -> ReferenceSource:
        """Return what the loop evaluates in every cycle; its values are those of `at`, to the bit."""
        return self

    def at_each(self, t: "NDArray[np.float64]") -> References:
        """Return the references at many instants, s after the start; the values of `at`, to the bit.

        A kind that has a faster way than `at` for each of them overrides it.
        """
        at = self.source().at
        return References(*np.array([at(one) for one in t.tolist()], float).reshape(-1, 3).T)

    def peaks(self, length: float) -> Peaks:
        """Return what it asks for once it has faded in, in the first `length` seconds."""
        looks = [self.at(length * k / _REFERENCE_POINTS) for k in range(_REFERENCE_POINTS + 1)]
        return Peaks(*(max(map(abs, column)) for column in zip(*looks, strict=True)))

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run: all but the soft start, which is over, or would jump."""
        keys = (key for key in cls.model_fields if key != "soft_start_s")
        return tuple(keys) if cls.in_run else ("kind",)


__all__ = ["Peaks", "ReferenceSettings", "ReferenceSource", "References"]
