"""Controllers: from reference and estimate to a voltage; one file each."""

from typing import NamedTuple, Protocol

from dcmp_hil.control.model import Model
from dcmp_hil.values import Estimate, Reference


class Controller(Protocol):
    """Protocol of a controller: reference and estimate in, voltage out."""

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return the voltage to ask for, V; both arguments hold for the instant at which it takes effect."""
        ...


class ControllerContext(NamedTuple):
    """Facts of the rig for the constructor of a controller.

    Parameters
    ----------
    model
        The believed plant.
    period
        s, nominal.
    """

    model: Model
    period: float


class Gains(NamedTuple):
    """Gains of a PD controller, which may change during a run."""

    kp: float  # 1/s2
    kd: float  # 1/s
    compensation: float  # 1 with w_hat, 0 without


__all__ = ["Controller", "ControllerContext", "Gains"]
