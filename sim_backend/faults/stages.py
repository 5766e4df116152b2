"""Stages of the host with faults around them: backend, observer, controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, Self

if TYPE_CHECKING:
    from types import TracebackType

    from dcmp_hil.values import Estimate, Reference, Sample, Truth
    from sim_backend.faults.listener import FaultListener


class HostFaults(Protocol):
    """Faults between the stages of a cycle."""

    listener: FaultListener

    def opened(self) -> None:
        """Start the time of the faults."""
        ...

    def sample(self, sample: Sample) -> Sample:
        """Return the sample that the loop gets."""
        ...

    def estimate(self, estimate: Estimate) -> Estimate:
        """Return the estimate that the loop gets from its observer."""
        ...

    def demand(self, demand: float) -> float:
        """Return the controller's voltage demand that the loop gets, V."""
        ...


class FaultyBackend:
    """A backend whose samples something happens to; everything else about it is the backend's own.

    Parameters
    ----------
    backend
        The simulated backend.
    faults
        What goes wrong.
    """

    def __init__(self, backend: Any, faults: HostFaults) -> None:
        self._backend, self._faults = backend, faults

    def __enter__(self) -> Self:
        """Open the backend; faults count their time from here."""
        self._backend.__enter__()
        self._faults.opened()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the backend."""
        self._backend.__exit__(kind, error, trace)

    def read(self) -> Sample:
        """Return the backend's sample, if nothing goes wrong."""
        sample: Sample = self._backend.read()
        return self._faults.sample(sample)

    def write(self, voltage: float) -> None:
        """Send a voltage to the backend, V."""
        self._faults.listener.wrote(voltage)
        self._backend.write(voltage)

    def truth(self) -> Truth:
        """Return the true state at the last sample."""
        truth: Truth = self._backend.truth()
        return truth

    def __getattr__(self, name: str) -> Any:
        """Return what else the backend has, such as the counters of its link."""
        return getattr(self._backend, name)


class FaultyObserver:
    """An observer whose estimate something happens to.

    Parameters
    ----------
    observer
        The observer.
    faults
        What goes wrong.
    """

    def __init__(self, observer: Any, faults: HostFaults) -> None:
        self._update, self._faults = observer.update, faults

    def update(self, sample: Sample) -> Estimate:
        """Return the observer's estimate, changed by the active faults."""
        return self._faults.estimate(self._update(sample))


class FaultyController:
    """A controller whose demand something happens to.

    Parameters
    ----------
    controller
        The controller.
    faults
        What goes wrong.
    """

    def __init__(self, controller: Any, faults: HostFaults) -> None:
        self._update, self._faults = controller.update, faults

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return the controller's demand, changed by the active faults, V."""
        return self._faults.demand(self._update(reference, estimate))
