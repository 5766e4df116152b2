"""Base of all faults: parameters with units and bounds, own random numbers, and active times."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.common.number_range import NumberRange

if TYPE_CHECKING:
    import random
    from collections.abc import Callable, Mapping

    from dcmp_hil.values import Truth
    from sim_backend.board.board import Board

Value = float | str


@dataclass(frozen=True, slots=True)
class Number:
    """A numerical parameter of a fault, with its bounds.

    Parameters
    ----------
    unit
        As people write it; empty for none.
    low, high
        Bounds, both allowed.
    default
        What holds if nothing is said.
    """

    unit: str
    low: float
    high: float
    default: float

    @property
    def allowed(self) -> NumberRange:
        """Return the bounds."""
        return NumberRange(self.low, self.high)


@dataclass(frozen=True, slots=True)
class Choice:
    """A parameter that is a word; the first one is the default."""

    words: tuple[str, ...]


class FaultContext(NamedTuple):
    """Facts for a function that decides when a fault begins."""

    tick: int  # periods since the backend was opened
    t: float  # s, the same
    truth: Truth  # of the plant


class RigFacts(NamedTuple):
    """Facts of the rig that faults may use."""

    carrier: str  # `cobs`, `slcan` or `can`; empty where there is no wire
    wired: bool  # whether a board stands between host and plant
    period: float  # s
    ku: float  # (rad/s2)/V, of the plant
    believed_ku: float  # the same, of [model]
    count_rad: float  # one count of the encoder
    node: int  # of the device


class FaultModel:
    """A fault while it is being injected; what it does depends on its level.

    Parameters
    ----------
    facts
        Of the rig.
    rng
        Its own, so that one fault more changes nothing about the others.
    params
        All of its kind's, in the kind's units.
    """

    on = False

    def __init__(self, facts: RigFacts, rng: random.Random, **params: Value) -> None:
        self.facts, self.rng = facts, rng
        self._params = params

    def number(self, name: str) -> float:
        """Return the value of a numerical parameter."""
        return float(self._params[name])

    def word(self, name: str) -> str:
        """Return the value of a parameter with a choice of words."""
        return str(self._params[name])

    def periods(self, name: str) -> int:
        """Return a parameter in ms as periods, at least one."""
        return max(1, round(1e-3 * self.number(name) / self.facts.period))

    def begin(self) -> None:
        """Start: the first period in which it is on."""

    def end(self) -> None:
        """Stop: the first period in which it is off again."""

    def tick(self, board: Board | None) -> None:
        """Begin a period in which the fault is active."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of fault.

    Parameters
    ----------
    make
        Makes its effect.
    says
        What it is, in a few words.
    params
        By name.
    wired
        Whether it needs a device on a wire, which the plain simulated rig is not.
    """

    make: Callable[..., FaultModel]
    says: str
    params: Mapping[str, Number | Choice] = field(default_factory=dict)
    wired: bool = False
