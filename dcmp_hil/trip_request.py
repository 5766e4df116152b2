"""A request to trip: every check of a run returns it where it objects; safety has no other way to say so."""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING, NamedTuple, Protocol

from dcmp_hil.errors import DcmpError, DeadlineError, TripError

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.errors import Explanation
    from dcmp_hil.values import Estimate, Sample


class Urgency(Enum):
    """Time that the way to 0 V may take."""

    NOW = auto()  # 0 V in this cycle
    RAMP = auto()  # authority shrinks to 0 V within 50 ms


class TripRequest(NamedTuple):
    """Why a run should end, and how fast. The supervisor decides; the loop raises the error at the end."""

    reason: str  # a word that stays the same from release to release
    sentence: str  # what was seen, with figures and units
    remedy: str  # what to look at first
    urgency: Urgency = Urgency.NOW
    late: bool = False  # a deadline was missed: exit code 5 instead of 4
    explain: Callable[[], Explanation] | None = None  # finds the likely cause; may take milliseconds
    cause: BaseException | None = None  # what a class of the user's own raised
    orderly: bool = False  # the voltage was led to 0 V before the end

    def error(self) -> DcmpError:
        """Return the error that ends the run."""
        if self.late:
            return DeadlineError(f"{self.sentence} {self.remedy}")
        trip = TripError(self.reason, self.sentence, self.remedy)
        trip.orderly, trip.explain, trip.__cause__ = self.orderly, self.explain, self.cause
        return trip


class Check(Protocol):
    """Protocol of a safety check that is made in every cycle."""

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:
        """Return why the run must stop; None if it may go on. Raises and calls back nothing."""
        ...
