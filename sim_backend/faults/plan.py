"""Fault plans: what goes wrong in a simulated run, when, and for how long; seeded, the same every time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.config.backends import Device, SimBoard
from dcmp_hil.errors import ConfigError
from sim_backend.faults.fault_model import RigFacts
from sim_backend.faults.fault_spec import KINDS, FaultSpec
from sim_backend.faults.injector import Injector
from sim_backend.faults.parser import WrongFaultError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from dcmp_hil.config import Rig
    from sim_backend.board.board import Board
    from sim_backend.faults.listener import FaultListener

_IDEAL_ENCODER_COUNTS_PER_REV = 4096.0  # counts a revolution in which faults of an ideal encoder are told


class FaultPlan:
    """Faults, and a seed.

    Parameters
    ----------
    faults
        In the order in which they act on one thing.
    seed
        Of everything in them that is random.
    """

    def __init__(self, faults: Iterable[FaultSpec] = (), seed: int = 1) -> None:
        self.faults: Sequence[FaultSpec] = tuple(faults)
        self.seed = seed

    def on(self, rig: Rig, listener: FaultListener | None = None, board: Board | None = None) -> Injector:
        """Prepare these faults for one run of a rig: `Session(rig, faults=plan.on(rig))`.

        Parameters
        ----------
        rig
            With a simulated backend.
        listener
            Told of what passes.
        board
            One that is there already, as it was left by another run.

        Raises
        ------
        ConfigError
            If a fault cannot happen to that rig; all of them at once.
        """
        wrong = [sentence for fault in self.faults if (sentence := _misfit(fault, rig))]
        if wrong:
            raise ConfigError(*wrong)
        return Injector(self.faults, self.seed, _facts(rig), listener, board)


def needs_wire(faults: Iterable[str | FaultSpec]) -> bool:
    """Whether one of the faults is of a wire or of the firmware; one that cannot be read is not."""
    named = (fault.partition(":")[0].strip() if isinstance(fault, str) else fault.kind for fault in faults)
    return any(kind in KINDS and KINDS[kind].wired for kind in named)


def kinds() -> dict[str, tuple[str, ...]]:
    """Return the kinds of fault, each with its keys."""
    return {name: (*kind.params, "at", "for") for name, kind in KINDS.items()}


def inject(rig: Rig, faults: Iterable[object], key: str = "faults:") -> Injector:
    """Prepare faults for one run of a rig; their seed is the simulation's.

    Parameters
    ----------
    rig
        With a simulated backend.
    faults
        Texts or objects.
    key
        What every message begins with.

    Raises
    ------
    ConfigError
        With everything that is wrong.
    """
    made: list[FaultSpec] = []
    wrong: list[str] = []
    for fault in faults:
        try:
            made.append(_read(fault))
        except WrongFaultError as error:
            wrong += error.faults
    if not wrong:
        try:
            return FaultPlan(made, rig.sim.seed).on(rig)
        except ConfigError as error:
            wrong += error.faults
    raise ConfigError(*(f"{key} {sentence}" for sentence in wrong))


def _read(fault: object) -> FaultSpec:
    if isinstance(fault, FaultSpec):
        return fault
    if isinstance(fault, str):
        return FaultSpec.of(fault)
    raise WrongFaultError([f"got {fault!r}; expected a text such as wire.drop:p=0.2,at=3s, or a FaultSpec."])


def _facts(rig: Rig) -> RigFacts:
    backend = rig.backend
    return RigFacts(
        carrier=backend.carrier if isinstance(backend, SimBoard) else "",
        wired=backend.device,
        period=rig.period,
        ku=rig.plant.ku,
        believed_ku=rig.model.ku_rad_s2_V,
        count_rad=math.tau / (rig.encoder.counts or _IDEAL_ENCODER_COUNTS_PER_REV),
        node=backend.node if isinstance(backend, Device) else 0,
    )


def _misfit(fault: FaultSpec, rig: Rig) -> str:
    backend = rig.backend
    got = f'{fault.kind}: got backend.kind = "{backend.kind}"'
    if not backend.simulated:
        return f'{got}; faults are for the simulated rigs. Set backend.kind = "sim-board".'
    if KINDS[fault.kind].wired and not backend.device:
        return f'{got}, which has no wire. Set backend.kind = "sim-board".'
    return ""
