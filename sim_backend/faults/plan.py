"""Fault plans: what goes wrong in a simulated run, when, and for how long; seeded, the same every time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from dcmp_hil.config.backends import Device, SimBoard
from dcmp_hil.errors import ConfigError
from sim_backend.faults.base import Number, RigFacts
from sim_backend.faults.firmware import FIRMWARE
from sim_backend.faults.host import HOST
from sim_backend.faults.injector import FaultContext, FaultListener, Injector
from sim_backend.faults.parser import WrongFaultError, check, parse
from sim_backend.faults.plant import PLANT
from sim_backend.faults.wire import WIRE

if TYPE_CHECKING:
    import random
    from collections.abc import Iterable, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.values import Estimate
    from sim_backend.faults.base import FaultModel, Value

KINDS = {**WIRE, **FIRMWARE, **PLANT, **HOST}
"""Every kind by name; the part before the dot is its level."""

When = int | float | str | Callable[[FaultContext], bool]
_NO_ENCODER = 4096.0  # counts a revolution in which faults of an ideal encoder are told


class Fault:
    """One thing that goes wrong.

    Parameters
    ----------
    kind
        A name in KINDS.
    at
        A whole number of periods or a number of seconds after the backend was opened, ``"boot"`` for from
        the very beginning, or a function that is asked in every period.
    for_
        The same as a length; infinity for ever.
    params
        The kind's, in its units; the rest has its defaults.

    Raises
    ------
    WrongFaultError
        If the kind is unknown, or a parameter is, or out of its bounds.
    """

    def __init__(self, kind: str, at: When = 0, for_: float = math.inf, **params: Value) -> None:
        parse(kind, KINDS)
        known = KINDS[kind].params
        faults = [f'{kind}: "{name}" is no parameter.' for name in params if name not in known]
        self.kind, self.at, self.for_ = kind, at, for_
        self.params: dict[str, Value] = {}
        for name, param in known.items():
            usual = param.default if isinstance(param, Number) else param.words[0]
            try:
                self.params[name] = check(name, params.get(name, usual), param)
            except ValueError as error:
                faults.append(f"{kind}: {error}")
        if faults:
            raise WrongFaultError(faults)

    @classmethod
    def of(cls, text: str) -> Fault:
        """Read one from text, such as ``wire.drop:p=0.2,at=3s,for=1s``."""
        kind, said = parse(text, KINDS)
        at, length = said.pop("at", 0), float(said.pop("for", math.inf))
        return cls(kind, at, length, **said)

    def make(self, facts: RigFacts, rng: random.Random) -> FaultModel:
        """Make its effect for one run."""
        return KINDS[self.kind].make(facts, rng, **self.params)


class FaultPlan:
    """Faults, and a seed.

    Parameters
    ----------
    faults
        In the order in which they act on one thing.
    seed
        Of everything in them that is random.
    """

    def __init__(self, faults: Iterable[Fault] = (), seed: int = 1) -> None:
        self.faults: Sequence[Fault] = tuple(faults)
        self.seed = seed

    def on(self, rig: Rig, listener: FaultListener | None = None, board: Any = None) -> Rig:
        """Return the rig with these faults in it, for one run.

        Parameters
        ----------
        rig
            With a simulated backend.
        listener
            Sees what happens.
        board
            One that is there already, as it was left by another run.

        Raises
        ------
        ConfigError
            If a fault cannot happen to that rig; all of them at once.
        """
        wrong: list[str] = [sentence for fault in self.faults for sentence in _misfits(fault, rig)]
        if wrong:
            raise ConfigError(*wrong)
        injection = Injector(self.faults, self.seed, _facts(rig), listener or FaultListener())
        changed: dict[str, Any] = {"backend": _with(rig.backend, injection=injection, injection_board=board)}
        if any(fault.kind.startswith("host.") for fault in self.faults):
            changed |= {
                "observer": _building(rig.observer, lambda made: _Observer(made, injection)),
                "controller": _building(rig.controller, lambda made: _Controller(made, injection)),
            }
        return rig.model_copy(update=changed)


def needs_wire(texts: Sequence[str]) -> bool:
    """Whether a fault that a command line asks for is one of a wire or of the firmware."""
    named = (text.partition(":")[0] for text in texts)
    return any(kind in KINDS and KINDS[kind].wired for kind in named)


def with_faults(rig: Rig, texts: Sequence[str], key: str = "--fault") -> Rig:
    """Return a rig with the faults that a command line asks for; their seed is the simulation's.

    Raises
    ------
    ConfigError
        With everything that is wrong, each beginning with `key`.
    """
    faults: list[Fault] = []
    wrong: list[str] = []
    for text in texts:
        try:
            faults.append(Fault.of(text))
        except WrongFaultError as error:
            wrong += error.faults
    if not wrong:
        try:
            return FaultPlan(faults, rig.sim.seed).on(rig)
        except ConfigError as error:
            wrong += error.faults
    raise ConfigError(*(f"{key} {sentence}" for sentence in wrong))


def _facts(rig: Rig) -> RigFacts:
    backend = rig.backend
    return RigFacts(
        carrier=backend.carrier if isinstance(backend, SimBoard) else "",
        period=rig.period,
        ku=rig.plant.ku,
        believed_ku=rig.model.ku_rad_s2_V,
        count_rad=math.tau / (rig.encoder.counts or _NO_ENCODER),
        node=backend.node if isinstance(backend, Device) else 0,
    )


def _misfits(fault: Fault, rig: Rig) -> list[str]:
    kind = rig.backend.kind
    if kind not in ("sim", "sim-board"):
        sentence = f'{fault.kind}: got backend.kind = "{kind}"; faults are for simulated rigs.'
        return [f"{sentence} Say --set backend.kind=sim-board."]
    wrong = []
    if KINDS[fault.kind].wired and kind == "sim":
        wrong.append(
            f'{fault.kind}: got backend.kind = "sim", which has no wire. Say --set backend.kind=sim-board.'
        )
    for name, section in (("observer", rig.observer), ("controller", rig.controller)):
        if fault.kind.startswith("host.") and not hasattr(section, "build"):
            wrong.append(f'{fault.kind}: got {name}.kind = "{section.kind}"; expected a shipped one.')
    return wrong


def _with(section: Any, **extra: object) -> Any:
    """Return a table of a rig that carries more than its file says; it is written as before."""
    kind = type(section)
    names = dict.fromkeys(extra, ClassVar[Any])
    made: Any = type(
        kind.__name__, (kind,), {"__annotations__": names, "__module__": kind.__module__, **extra}
    )
    return made.model_construct(section.model_fields_set, **dict(section))


def _building(section: Any, wrap: Callable[[Any], Any]) -> Any:
    """Return a table whose observer or controller is wrapped as it is made."""
    build = type(section).build
    return _with(section, build=lambda self, setting: wrap(build(self, setting)))


class _Observer:
    """An observer that host faults act on."""

    def __init__(self, observer: Any, injection: Injector) -> None:
        self._observer, self._injection = observer, injection

    def update(self, sample: Any) -> Estimate:
        """Estimate; then it goes wrong."""
        return self._injection.estimate(self._observer.update(sample))


class _Controller:
    """A controller that host faults act on."""

    def __init__(self, controller: Any, injection: Injector) -> None:
        self._controller, self._injection = controller, injection

    def update(self, reference: Any, estimate: Any) -> float:
        """Control; then it goes wrong."""
        return self._injection.demand(self._controller.update(reference, estimate))
