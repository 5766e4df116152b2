"""Backends are found by name and made here, real or simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dcmp_hil.device.links.registry import BACKENDS
from dcmp_hil.errors import ConfigError
from dcmp_hil.fault_hooks import NO_FAULTS
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.plugins.checked_backend import CheckedBackend
from dcmp_hil.plugins.named_class import find_named, make
from dcmp_hil.plugins.roles import BACKEND

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.backend import Backend
    from dcmp_hil.config import Rig
    from dcmp_hil.fault_hooks import Faults
    from dcmp_hil.platform.clock import Clock


def open_backend(rig: Rig, clock: Clock, faults: Faults = NO_FAULTS, *, clear: bool = False) -> Backend:
    """Return the backend that `rig.backend.kind` names; enter it to open the device.

    Parameters
    ----------
    rig
        Its `[backend]` says which.
    clock
        What paces a simulation, and measures how long a device takes.
    faults
        What goes wrong on purpose.
    clear
        Whether a fault that waits for a person is cleared.

    Raises
    ------
    ConfigError
        If there is none by that name, or it is a real device and the rig or the clock is not for one.
    """
    kind = rig.backend.kind
    if kind in BACKENDS:
        ours = _allowed(find_named(BACKENDS[kind], BACKEND.key), rig, clock)
        return faults.backend(
            lambda *arguments, **options: _told(ours(*arguments, **options), clear=clear), rig, clock
        )
    own = _allowed(find_named(kind, BACKEND.key, BACKENDS, rig.plugin_folders), rig, clock)

    def checked(*arguments: Any, **options: Any) -> Backend:
        return CheckedBackend(_told(make(own, kind, BACKEND, arguments, options), clear=clear), kind)

    return faults.backend(checked, rig, clock)


def _told(backend: Any, *, clear: bool) -> Any:
    """Return the backend, with its flag `clear` set if it has one."""
    if isinstance(getattr(backend, "clear", None), bool):
        backend.clear = clear
    return backend


def _allowed(factory: Callable[..., Any], rig: Rig, clock: Clock) -> Callable[..., Any]:
    if not getattr(factory, "simulated", False):
        _refuse_simulation_only(rig, clock)
    return factory


def _refuse_simulation_only(rig: Rig, clock: Clock) -> None:
    """Raise if a real device would get settings that only a simulation may have."""
    if isinstance(clock, SimulatedClock):
        raise ConfigError(
            f'fast: backend.kind = "{rig.backend.kind}" runs in real time; virtual time needs a simulated '
            'rig: backend.kind = "sim", or a Factory with the attribute `simulated = True`.'
        )
    if rig.simulation_only:
        raise ConfigError(
            f'backend.kind: got "{rig.backend.kind}", but {", ".join(rig.simulation_only)} is for simulation '
            'only. Set backend.kind = "sim", or start from the rig bench-1khz.'
        )
