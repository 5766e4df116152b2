"""The Moreau plant compiled from the C core: the same bits as `MoreauPlant`, in less time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.values import Truth
from sim_backend.core_library import FIELDS, Simulation, load

if TYPE_CHECKING:
    from dcmp_hil.control.model import Model

_VOLTAGE, _STEP = FIELDS["voltage"], FIELDS["step"]
_POSITION, _VELOCITY, _DISTURBANCE = FIELDS["position"], FIELDS["velocity"], FIELDS["disturbance"]


class CorePlant:
    """The pendulum of eqs. (1)-(4) with a friction that can stick.

    Parameters
    ----------
    plant, model, position, step, steps
        As for MoreauPlant.

    Raises
    ------
    OpenError
        If there is no compiler, it fails, or the cache cannot be written.
    """

    def __init__(self, plant: Model, model: Model, *, position: float, step: float, steps: int) -> None:
        self._step = load().simlib_plant
        simulation = Simulation(
            **plant._asdict(),
            believed_f0=model.f0,
            believed_ku=model.ku,
            step=step,
            steps=steps,
            position=position,
        )
        self._pointer, self._numbers = simulation.pointer, simulation.numbers

    def advance(self, voltage: float) -> Truth:
        """Hold `voltage` (V) for one period and return the state at its end."""
        numbers = self._numbers
        numbers[_VOLTAGE] = voltage
        self._step(self._pointer)
        # 0.08 us less than the constructor
        return make(Truth, (numbers[_POSITION], numbers[_VELOCITY], numbers[_DISTURBANCE]))

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        self._numbers[_STEP] *= factor
