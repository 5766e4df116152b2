"""The tables of a sweep's file: which rig, which of its keys take which values, and how many runs."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from dcmp_hil.common.section import Section
from dcmp_hil.control.elementary import exponential, logarithm

GRID_STEPS_MAX = 100_000
RUNS_MAX = 100_000_000
Scalar = bool | int | float | str
_Ends = Annotated[list[float], Field(min_length=2, max_length=2)]


class GridRange(Section):
    """`{ from = 1000, to = 5000, steps = 5 }`: values between two ends, both included."""

    model_config = ConfigDict(serialize_by_alias=True)

    first: float = Field(alias="from")
    """First value, in the unit of the key."""
    last: float = Field(alias="to")
    """Last value, in the unit of the key."""
    steps: Annotated[int, Field(ge=1, le=GRID_STEPS_MAX)]
    """Number of values."""
    scale: Literal["linear", "log"] = "linear"
    """Equal differences, or equal ratios."""

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if self.steps > 1 and self.first == self.last:
            raise ValueError("an empty range: from and to are the same. Write another end, or steps = 1.")
        if self.scale == "log" and not (self.first > 0.0 and self.last > 0.0):
            raise ValueError('scale = "log" needs both ends above 0. Write other ends, or scale = "linear".')
        return self

    def values(self) -> list[float]:
        """Return the values; the ends are met to the bit."""
        if self.steps == 1:
            return [self.first]
        inner = [self._value(k / (self.steps - 1)) for k in range(1, self.steps - 1)]
        return [self.first, *inner, self.last]

    def _value(self, share: float) -> float:
        if self.scale == "log":
            return self.first * exponential(share * logarithm(self.last / self.first))
        return self.first + (self.last - self.first) * share


class DrawRule(Section):
    """A distribution of a key, one of four: `{ normal = [1.3, 0.1] }`."""

    uniform: _Ends | None = None
    """Lowest and highest value, in the unit of the key."""
    loguniform: _Ends | None = None
    """The same, with equal ratios equally likely; both above 0."""
    normal: _Ends | None = None
    """Mean and standard deviation, in the unit of the key."""
    choice: Annotated[list[Scalar], Field(min_length=1)] | None = None
    """Values that are equally likely."""

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if len(self.model_fields_set) != 1:
            raise ValueError("expected one of uniform, loguniform, normal and choice.")
        ends = self.uniform or self.loguniform
        if ends and not ends[0] < ends[1]:
            raise ValueError("an empty range: write the lower end first, and a higher one behind it.")
        if self.loguniform and not self.loguniform[0] > 0.0:
            raise ValueError("loguniform needs both ends above 0. Write other ends, or uniform.")
        if self.normal and not self.normal[1] > 0.0:
            raise ValueError("normal needs a standard deviation above 0. Write [mean, deviation].")
        return self


GridAxis = Annotated[list[Scalar], Field(min_length=1, max_length=GRID_STEPS_MAX)] | GridRange


class SweepSpec(Section):
    """Settings of one sweep."""

    rig: Annotated[str, Field(min_length=1, max_length=4096, examples=["bench-1khz"])]
    """A shipped rig, or the path of a rig.toml; a relative path starts from the folder of this file."""
    duration_s: Annotated[float, Field(gt=0, le=1e6, examples=[10.0])]
    """Length of each run in device time, s."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Seed of all draws, and of the noise of each run."""
    runs: Annotated[int, Field(ge=1, le=RUNS_MAX)] = 1
    """Runs at each point of the grid; each has draws of its own, the same ones at every point."""
    faults: list[str] = Field(default_factory=list)
    """Faults that are injected into every run, as behind `dcmp-hil run --fault`."""
    set: dict[str, Scalar] = Field(default_factory=dict)
    """Keys of the rig, in dotted form, that differ from its file in every run."""
    grid: dict[str, GridAxis] = Field(default_factory=dict)
    """Keys of the rig that take every value of a list or a range, in all combinations."""
    draw: dict[str, DrawRule] = Field(default_factory=dict)
    """Keys of the rig that are drawn for each run."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys that differ from run to run: those of the grid, then those that are drawn."""
        return (*self.grid, *self.draw)

    @property
    def axes(self) -> list[list[Scalar]]:
        """Values of each key of the grid."""
        return [list(axis.values() if isinstance(axis, GridRange) else axis) for axis in self.grid.values()]

    @property
    def total(self) -> int:
        """Number of runs."""
        return self.runs * math.prod(len(axis) for axis in self.axes)
