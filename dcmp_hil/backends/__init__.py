"""Backends: the way to a device, real or simulated; found by name, opened by `open_backend`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, Self

from dcmp_hil.backends.kinds import KINDS
from dcmp_hil.plugins import find_named

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from dcmp_hil.clock import Clock
    from dcmp_hil.config import Rig
    from dcmp_hil.values import Sample, Truth


class Backend(Protocol):
    """A device. A context manager: leaving it drives 0 V, however it is left."""

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


def open_backend(rig: Rig, clock: Clock) -> Backend:
    """Find the backend that `rig.backend.kind` names and make it; enter it to open the device.

    Raises
    ------
    ConfigError
        If there is none by that name.
    """
    kind = rig.backend.kind
    factory: Callable[[Rig, Clock], Backend] = find_named(KINDS.get(kind, kind), "backend.kind", KINDS)
    return factory(rig, clock)
