"""Hooks for injected faults in a run; without a plan they do nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar, cast

from dcmp_hil.plugins.named_class import find_named

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from dcmp_hil.backend import Backend
    from dcmp_hil.config import Rig
    from dcmp_hil.control.controllers import Controller
    from dcmp_hil.control.observers import Observer
    from dcmp_hil.platform.clock import Clock

_Stage = TypeVar("_Stage")
_INJECT, _NEEDS_WIRE = "sim_backend.faults.plan:inject", "sim_backend.faults.plan:needs_wire"
_KINDS = "sim_backend.faults.plan:kinds"


class Faults(Protocol):
    """Protocol of the injected faults of one run, for the code that makes its stages."""

    def backend(self, factory: Callable[..., Backend], rig: Rig, clock: Clock) -> Backend:
        """Make the backend, with its faults between device and loop."""
        ...

    def observer(self, observer: Observer) -> Observer:
        """Return the observer, wrapped so that its faults act."""
        ...

    def controller(self, controller: Controller) -> Controller:
        """Return the controller, wrapped so that its faults act."""
        ...


class _NoFaults:
    """Nothing goes wrong on purpose: every stage is as it was made."""

    @staticmethod
    def backend(factory: Callable[..., Backend], rig: Rig, clock: Clock) -> Backend:
        return factory(rig, clock)

    @staticmethod
    def observer(observer: _Stage) -> _Stage:
        return observer

    @staticmethod
    def controller(controller: _Stage) -> _Stage:
        return controller


NO_FAULTS: Faults = _NoFaults()


def inject(rig: Rig, faults: Iterable[object], key: str = "faults:") -> Faults:
    """Prepare faults for one run of a simulated rig; their seed is `sim.seed`.

    Parameters
    ----------
    rig
        What will be run.
    faults
        Texts, such as ``wire.drop:p=0.2,at=3s,for=1s``, or objects of the class
        `sim_backend.faults.fault_spec.FaultSpec`.
    key
        What the user wrote them behind, for the messages.

    Raises
    ------
    ConfigError
        With everything that is wrong with them.
    """
    listed = (faults,) if isinstance(faults, str) else tuple(faults)
    if not listed:
        return NO_FAULTS
    prepare: Callable[..., Faults] = find_named(_INJECT, key)
    return prepare(rig, listed, key)


def needs_wire(faults: Iterable[str]) -> bool:
    """Whether one of the faults is of a wire or of the firmware, which the plain simulated rig has not."""
    listed = tuple(faults)
    return bool(listed) and cast("bool", find_named(_NEEDS_WIRE, "faults")(listed))


def kinds() -> dict[str, tuple[str, ...]]:
    """Return the kinds of fault that can be injected, each with its keys."""
    return cast("dict[str, tuple[str, ...]]", find_named(_KINDS, "faults")())
