"""A controller for every user, as a developer would add it: gains that are ramped in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

from dcmp_hil.common.section import NotNegative
from dcmp_hil.control.controllers.settings import ControllerSettings

if TYPE_CHECKING:
    from dcmp_hil.control.controllers import ControllerContext
    from dcmp_hil.values import Estimate, Reference


class ProportionalGains(NamedTuple):
    """Gains of the controller."""

    kp: float  # V/rad
    kd: float  # V s/rad


class ProportionalSettings(ControllerSettings):
    """`[controller]` with `kind = "proportional"`."""

    kind: Literal["proportional"]
    kp_V_rad: NotNegative = 40.0
    """Volts a radian."""
    kd_V_s_rad: NotNegative = 5.0
    """Volts for a rad/s."""
    position: Literal["estimated", "measured"] = "estimated"
    """Position that the controller gets: x1_hat (quiet) or the encoder's."""

    def build(self, context: ControllerContext) -> Proportional:  # noqa: ARG002
        """Make the controller for a rig."""
        return Proportional(self.gains)

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run."""
        return ("kp_V_rad",)

    @property
    def gains(self) -> ProportionalGains:
        """The gains without pydantic."""
        return ProportionalGains(self.kp_V_rad, self.kd_V_s_rad)


class Proportional:
    """V = kp (x_r - x) + kd (x_r' - x')."""

    def __init__(self, gains: ProportionalGains) -> None:
        self.gains = gains

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return the voltage, V."""
        kp, kd = self.gains
        return kp * (reference.position - estimate.position) + kd * (reference.velocity - estimate.velocity)
