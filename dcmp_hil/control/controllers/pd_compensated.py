"""PD tracking, with (eq. 10) or without (the baseline) compensation of the estimated disturbance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from dcmp_hil.common.section import NotNegative
from dcmp_hil.control.controllers import Gains
from dcmp_hil.control.controllers.settings import ControllerSettings

if TYPE_CHECKING:
    from dcmp_hil.control.controllers import ControllerContext
    from dcmp_hil.values import Estimate, Reference

_DAMPING_RATIO_MIN = 0.5


class PdSettings(ControllerSettings):
    """`[controller]` with `kind = "pd_compensated"` (eq. 10) or `"pd"` (the same without w_hat)."""

    kind: Literal["pd_compensated", "pd"] = "pd_compensated"
    kp_1_s2: NotNegative = 4000.0
    """Proportional gain of eq. (14), 1/s2."""
    kd_1_s: NotNegative = 130.0
    """Derivative gain of eq. (14), 1/s."""
    position: Literal["estimated", "measured"] = "estimated"
    """Position in the proportional term: x1_hat (quiet) or the encoder's (as in the paper)."""
    friction_feedforward: bool = False
    """Tell the observer of Coulomb friction, f1 of [model], by the sign of the reference's velocity."""

    @property
    def gains(self) -> Gains:
        """The gains without pydantic, for the loop."""
        return Gains(self.kp_1_s2, self.kd_1_s, float(self.kind == "pd_compensated"))

    def build(self, context: ControllerContext) -> PdCompensated:
        """Make the controller for a rig."""
        return PdCompensated(
            context, kp=self.kp_1_s2, kd=self.kd_1_s, compensate=self.kind == "pd_compensated"
        )

    @property
    def feeds_friction_forward(self) -> bool:
        """Whether the friction of `[model]` is a known input of the observer."""
        return self.friction_feedforward

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run; the two kinds are one class, so `kind` is among them."""
        return ("kind", "kp_1_s2", "kd_1_s")

    def warning(self) -> str:
        """Return a warning of a loop that will ring."""
        if self.kp_1_s2 == 0.0:
            return ""
        zeta = self.kd_1_s / (2.0 * math.sqrt(self.kp_1_s2))
        if zeta >= _DAMPING_RATIO_MIN:
            return ""
        return f"controller: damping kd/(2 sqrt kp) = {zeta:.2f} will ring; kd = 2 sqrt kp gives 1."


class PdCompensated:
    """Corrected eq. (10): u = -w_hat - kp (x1 - x_r) - kd (x2 - x_r') + f0 x2 + x_r'', V = u / (ku/J).

    The paper prints a factor 1/ku in front as well, which divides once too often: eq. (4) has u = (ku/J) V.

    Parameters
    ----------
    context
        The rig served.
    kp, kd
        1/s2 and 1/s; the closed loop's error obeys s^2 + kd s + kp.
    compensate
        False leaves w_hat out: the baseline that shows what the observer is worth.
    """

    def __init__(
        self, context: ControllerContext, *, kp: float = 4000.0, kd: float = 130.0, compensate: bool = True
    ) -> None:
        self._kp, self._kd = kp, kd
        self._f0, self._volts = context.model.f0, 1.0 / context.model.ku
        self._compensation = 1.0 if compensate else 0.0

    @property
    def gains(self) -> Gains:
        """Gains in use; may be set between two cycles."""
        return Gains(self._kp, self._kd, self._compensation)

    @gains.setter
    def gains(self, gains: Gains) -> None:
        self._kp, self._kd, self._compensation = gains

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return the voltage to ask for, V."""
        xr, vr, ar = reference
        x1, x2, w = estimate
        u = ar - self._compensation * w - self._kp * (x1 - xr) - self._kd * (x2 - vr) + self._f0 * x2
        return u * self._volts
