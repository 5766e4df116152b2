"""A known part of the disturbance: Coulomb friction by the sign of the reference's velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil.control.model import Model
    from dcmp_hil.values import Estimate, Sample

_CROSSING_RAD_S = 0.005  # the sign is a ramp inside it, so that the voltage stays continuous


class FrictionFeedforward:
    """Relieves any observer of the jump of 2 f1 at every reversal (`controller.friction_feedforward`).

    The observer gets friction as a known input, -f1 sat(x_r' / 0.005 rad/s), in the voltage of its sample.
    So it has only the rest of w to find; what the loop reports, and compensates, is the whole w. The loop
    hands the reference's velocities in.

    Parameters
    ----------
    model
        The believed plant.
    """

    def __init__(self, model: Model) -> None:
        self._f1, self._volts = model.f1, 1.0 / model.ku
        self._t = 0.0  # s, device time of the last sample

    def middle(self, t: float) -> float:
        """Return the middle between the last sample and one at `t`, device time in s."""
        return 0.5 * (t + self._t)

    def told(self, sample: Sample, velocity: float) -> Sample:
        """Return the sample for the observer, with the friction that acted since the last one as a voltage.

        Parameters
        ----------
        sample
            As it was read.
        velocity
            rad/s, of the reference at the `middle` of the last sample and this one.
        """
        held = self._friction(velocity) if sample.t > self._t else 0.0
        self._t = sample.t
        return sample._replace(voltage=sample.voltage + held * self._volts)

    def whole(self, rest: Estimate, velocity: float) -> Estimate:
        """Return the estimate with the friction that will act when the command does.

        Parameters
        ----------
        rest
            The observer's estimate, whose disturbance lacks the friction.
        velocity
            rad/s, of the reference at the instant at which the command takes effect.
        """
        return rest._replace(disturbance=rest.disturbance + self._friction(velocity))

    def _friction(self, velocity: float) -> float:
        """Return the friction believed to act, rad/s2."""
        return -self._f1 * max(-1.0, min(1.0, velocity / _CROSSING_RAD_S))
