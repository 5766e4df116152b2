"""The equations as the paper prints them, misprints and all: they show what each misprint costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.control.controllers.pd_compensated import PdCompensated
from dcmp_hil.control.observers.paper import PaperObserver

if TYPE_CHECKING:
    from dcmp_hil.control.controllers import ControllerContext
    from dcmp_hil.values import Estimate, Reference


class PrintedEq9(PaperObserver):
    """The observer with w_hat = v3 + L2 v1 + f0 v2, eq. (9) as printed.

    It lacks L1 v2 + f0 L1 v1: with e = y - z1, eqs. (3) and (6) give
    w = e'' + (L1 + f0) e' + (L2 + f0 L1) e.
    """

    def disturbance(self) -> float:
        """Return w_hat by the printed eq. (9), rad/s2."""
        return self.v3 + self.L2 * self.v1 + self._f0 * self.v2


class PrintedEq8(PaperObserver):
    """The observer with eq. (8) read to the letter, where v1' stands for two different things.

    The first line is taken for the v1' that the third one compares v2 with, so the v2 that the second
    line adds is missing there:

        a = -l1 M^(1/3) |v1 - e|^(2/3) sgn(v1 - e),            v1' = a + v2,
        v2' = -l2 M^(1/2) |v2 - a|^(1/2) sgn(v2 - a) + v3,     v3' = -l3 M sgn(v3 - v2').
    """

    def _euler_step(self, dt: float, u: float) -> None:
        e = self._y - self._z1
        v1, v2, v3 = self.v1, self.v2, self.v3
        a = -self._n1_gain * math.copysign(abs(v1 - e) ** (2 / 3), v1 - e)
        n2 = v3 - self._n2_gain * math.copysign(math.sqrt(abs(v2 - a)), v2 - a)
        n3 = -math.copysign(self._n3_gain, v3 - n2) if v3 != n2 else 0.0
        self.v1, self.v2, self.v3 = v1 + dt * (a + v2), v2 + dt * n2, v3 + dt * n3
        z1, z2 = self._z1, self._z2
        self._z1 = z1 + dt * (z2 + self.L1 * e)
        self._z2 = z2 + dt * (u - self._f0 * z2 + self.L2 * e)


class PrintedEq10(PdCompensated):
    """The controller with u = (1/ku) [..], eq. (10) as printed, which divides once too often.

    Eq. (4) already turns u into a voltage, V = u / (ku/J), and eq. (12) gives ku/J and nothing else. So the
    whole loop, compensation included, is weaker by that factor: [..] / (ku/J)^2 instead of [..] / (ku/J).

    Parameters
    ----------
    context
        The rig served.
    kp, kd
        1/s2 and 1/s.
    """

    def __init__(self, context: ControllerContext, *, kp: float = 4000.0, kd: float = 130.0) -> None:
        super().__init__(context, kp=kp, kd=kd)
        self._once_more = 1.0 / context.model.ku

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return the voltage to ask for, V."""
        return super().update(reference, estimate) * self._once_more
