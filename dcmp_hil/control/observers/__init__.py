"""Observers: from sampled positions to position, velocity and disturbance; one file each."""

from typing import ClassVar, NamedTuple, Protocol

from dcmp_hil.control.model import Model
from dcmp_hil.errors import ProtocolError
from dcmp_hil.values import Estimate, Reference, Sample

GAP_PERIODS_MAX = 10
"""Periods; after a longer gap nothing is left to continue from, and an observer restarts."""
STEP_TOLERANCE_PERIODS = 0.02
"""Periods: a step this close to a whole number of periods counts as that."""


class Observer(Protocol):
    """Protocol of an observer: sample in, estimate out."""

    def update(self, sample: Sample) -> Estimate:
        """Take the next sample and return the estimate at `sample.t`."""
        ...


class DiagnosedObserver(Protocol):
    """Protocol of what an observer may have besides: numbers of its inside, for telemetry.

    Attributes
    ----------
    DIAGNOSIS
        Their names, lower case, each with its unit at the end, such as ``bias_rad``.
    """

    DIAGNOSIS: ClassVar[tuple[str, ...]]

    def diagnose(self) -> tuple[float, ...]:
        """Return a number for each name, after the last sample; called when the command has left."""
        ...


class Predictor(Protocol):
    """Protocol of a predictor: from the estimate at a sample to the state at which its command acts."""

    def ahead(self, sample: Sample, estimate: Estimate, reference: Reference, /) -> Estimate:
        """Return the state at the instant of `reference`, at which the next command takes effect.

        Its disturbance is the one to compensate there.
        """
        ...

    def sent(self, voltage: float, /) -> None:
        """Remember what was just sent, V: it is under way until the next sample."""
        ...


class ObserverContext(NamedTuple):
    """Facts of the rig for the constructor of an observer.

    Parameters
    ----------
    model
        The believed plant.
    period
        s, nominal.
    counts_per_rev
        Encoder counts a revolution; None for an ideal encoder.
    """

    model: Model
    period: float
    counts_per_rev: float | None


def standing_still(before: float, t: float) -> ProtocolError:
    """Return the error for a sample at `t` that does not come after the one at `before`, both in s."""
    return ProtocolError(
        f"The sample at t = {t:.6f} s does not come after the one at {before:.6f} s. "
        "Check the device's clock, or the time column of the recording."
    )


__all__ = [
    "GAP_PERIODS_MAX",
    "STEP_TOLERANCE_PERIODS",
    "DiagnosedObserver",
    "Observer",
    "ObserverContext",
    "Predictor",
    "standing_still",
]
