"""The tree of errors: every message names its remedy, every branch has its exit code."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dcmp_hil.values import Cycle


class ExitCode(IntEnum):
    """Exit codes of the commands, as docs/cli.md lists them; 128 + n for signal n."""

    OK = 0
    FAILED = 1
    CONFIG = 2
    BACKEND = 3
    TRIP = 4
    DEADLINE = 5
    INCOMPLETE = 6
    FORCED = 7
    INTERRUPTED = 130


class DcmpError(Exception):
    """Base class of the exceptions of this package.

    Attributes
    ----------
    result
        Columns, figures and events of the run that it ended; `dcmp_hil.run` fills it in, otherwise None.
    """

    exit_code: ClassVar[int] = ExitCode.FAILED
    result: Any = None  # a `dcmp_hil.Result`, whose module is above this one


class ConfigError(DcmpError):
    """The rig, an option or an input file is wrong; lists every fault found, not only the first.

    Parameters
    ----------
    faults
        One sentence or short paragraph per fault: place, what was got, what was expected, remedy.
    """

    exit_code: ClassVar[int] = ExitCode.CONFIG

    def __init__(self, *faults: str) -> None:
        super().__init__("\n".join(faults))
        self.faults = faults


class BackendError(DcmpError):
    """The device, or the link to it, failed."""

    exit_code: ClassVar[int] = ExitCode.BACKEND


class OpenError(BackendError):
    """The backend could not be opened."""


class LinkError(BackendError):
    """The link broke during a run."""


class SampleTimeoutError(BackendError):
    """No sample arrived in time."""


class ProtocolError(BackendError):
    """A received message contradicts the protocol, such as a time that stands still."""


class Explanation(NamedTuple):
    """Explanation of a trip once its cause was found: the arguments of TripError."""

    reason: str
    sentence: str
    remedy: str


class TripError(DcmpError):
    """The supervisor, or the device, stopped the run; the amplifier is at 0 V.

    Parameters
    ----------
    reason
        A short word that stays the same from release to release, such as ``disturbance``.
    sentence
        What was seen, with figures and units.
    remedy
        What to look at first.
    """

    exit_code: ClassVar[int] = ExitCode.TRIP

    def __init__(self, reason: str, sentence: str, remedy: str) -> None:
        super().__init__(f"{sentence} {remedy}")
        self.reason = reason
        self.sentence = sentence
        self.remedy = remedy
        self.cycles: Sequence[Cycle] = ()  # the last second, filled in by the loop
        self.further: tuple[str, ...] = ()  # names of further columns
        self.further_values: Sequence[tuple[float, ...]] = ()  # of each of those cycles
        self.orderly = False  # the voltage was led to 0 V before: the device has no fault to keep
        self.explain: Callable[[], Explanation] | None = None

    def explained(self) -> TripError:
        """Return it with its likely cause, which may take milliseconds to find."""
        if self.explain is None:
            return self
        trip = TripError(*self.explain())
        trip.orderly = self.orderly
        for note in getattr(self, "__notes__", ()):
            trip.add_note(note)
        return trip


class DeadlineError(DcmpError):
    """Deadlines were missed under `timing.overrun = "stop"`, or cannot be promised under "enforce"."""

    exit_code: ClassVar[int] = ExitCode.DEADLINE


class IncompleteError(DcmpError):
    """A recording lacks something, or could not be checked; what is right in it was used."""

    exit_code: ClassVar[int] = ExitCode.INCOMPLETE
