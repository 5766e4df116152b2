"""Choice of what computes the simulated plant: the compiled core, or Python."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import OpenError
from sim_backend.core_library import load

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

_PLANT_OF_THE_CORE = "sim_backend.plant:MoreauPlant"


class Engine(NamedTuple):
    """Choice for one rig.

    Parameters
    ----------
    core
        Whether it is the compiled core; otherwise Python.
    remark
        Why it is not the core though the rig asks for it and its plant is one of the core's; else empty.
    """

    core: bool
    remark: str = ""

    @property
    def remarks(self) -> tuple[str, ...]:
        """The remark as remarks of a backend."""
        return (self.remark,) if self.remark else ()


def is_for_core(rig: Rig) -> bool:
    """Return whether a rig asks for the core, and its plant is one of the core's."""
    sim = rig.sim
    return sim.engine == "core" and sim.details is None and sim.plant_class == _PLANT_OF_THE_CORE


def engine_of(rig: Rig) -> Engine:
    """Return the engine of a rig; the core is compiled when it is first used."""
    if not is_for_core(rig):
        return Engine(core=False)
    try:
        load()
    except OpenError as error:
        return Engine(
            core=False,
            remark=f"The simulated plant runs in Python, with the same results in more time. {error}",
        )
    return Engine(core=True)
