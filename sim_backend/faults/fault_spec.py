"""A fault: its kind, its active time, and its parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from sim_backend.faults.fault_model import FaultContext, Number, RigFacts
from sim_backend.faults.firmware import FIRMWARE
from sim_backend.faults.host import HOST
from sim_backend.faults.parser import WrongFaultError, check, parse, unknown_parameter
from sim_backend.faults.plant import PLANT
from sim_backend.faults.wire import WIRE

if TYPE_CHECKING:
    import random

    from sim_backend.faults.fault_model import FaultModel, Value

KINDS = {**WIRE, **FIRMWARE, **PLANT, **HOST}
"""Every kind by name; the part before the dot is its level."""

When = int | float | str | Callable[[FaultContext], bool]


class FaultSpec:
    """One fault of a plan: kind, time and parameters.

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
        faults = [f"{kind}: {unknown_parameter(name, known)}" for name in params if name not in known]
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
    def of(cls, text: str) -> FaultSpec:
        """Read one from text, such as ``wire.drop:p=0.2,at=3s,for=1s``."""
        kind, said = parse(text, KINDS)
        at, length = said.pop("at", 0), float(said.pop("for", math.inf))
        return cls(kind, at, length, **said)

    def make(self, facts: RigFacts, rng: random.Random) -> FaultModel:
        """Return the model of the fault for one run."""
        return KINDS[self.kind].make(facts, rng, **self.params)


Fault = FaultSpec
"""The name before; `FaultSpec` is not to be taken for the fault codes of a device, `dcmp_hil.Fault`."""
