"""The protocol of a backend: the way to a device, real or simulated, as the loop uses it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from types import TracebackType

    from dcmp_hil.values import Sample, Truth


class Backend(Protocol):
    """A device. A context manager: leaving it drives 0 V, however it is left.

    A factory whose devices are simulated says so by an attribute `simulated = True`; only then it is given
    virtual time, or a rig without limits.
    """

    def __enter__(self) -> Self:
        """Open the device, disarmed."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Drive 0 V, disarm, close."""
        ...

    def read(self) -> Sample:
        """Wait for the next sample: the device paces the loop."""
        ...

    def write(self, voltage: float) -> None:
        """Send a voltage, V; never blocks."""
        ...

    def truth(self) -> Truth:
        """Return what a simulation knows at the last sample; NaN on a real device. For telemetry only."""
        ...
