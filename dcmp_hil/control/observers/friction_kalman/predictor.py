"""The state at the instant at which a command acts, with the friction that will act then."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.control.elementary import sine
from dcmp_hil.control.observers.friction_kalman.motion import moved
from dcmp_hil.values import Estimate

if TYPE_CHECKING:
    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman
    from dcmp_hil.values import Reference, Sample

_CROSSING_RAD_S = 0.001  # rad/s of the reference: inside it the sign of friction is a ramp


class FrictionPredictor:
    """Carries the filter's state over the command under way, as its own prediction does.

    What is compensated is not what is reported. At rest friction holds any torque up to f: to compensate
    the friction of the moment would make the arm hunt. The friction that will act once the arm follows its
    reference is known by the sign of the reference's velocity:

        w_c = d - g sin x1 - f sat(x_r' / 0.001 rad/s).

    Parameters
    ----------
    observer
        Its state is read, and stays.
    context
        The rig served.
    delay_samples
        Periods between a sample and the instant at which its command takes effect: 0 or 1.
    measured
        Give the controller the encoder's position in place of the predicted one.
    """

    def __init__(
        self, observer: FrictionKalman, context: ObserverContext, delay_samples: int, *, measured: bool
    ) -> None:
        self._observer, self._period = observer, context.period
        model = context.model
        self._f0, self._gravity, self._ku = model.f0, model.gravity, model.ku
        self._delayed, self._measured = delay_samples == 1, measured
        self._under_way = 0.0  # V

    def ahead(self, sample: Sample, estimate: Estimate, reference: Reference) -> Estimate:  # noqa: ARG002
        """Return the state at the instant at which the next command takes effect; see `Predictor`."""
        x1, x2, d, f, s = self._observer.state
        gravity = self._gravity
        if self._delayed:
            u = self._ku * self._under_way
            x1, x2, d, _, _, _ = moved(x1, x2, d, f, s, self._period, u, self._f0, gravity)
        direction = reference.velocity / _CROSSING_RAD_S
        direction = -1.0 if direction < -1.0 else min(direction, 1.0)
        w = d - gravity * sine(x1) - f * direction
        x1 = sample.position if self._measured else x1
        return make(Estimate, (x1, x2, w))  # 0.09 us less

    def sent(self, voltage: float) -> None:
        """Remember what was just sent, V: it is under way until the next sample."""
        self._under_way = voltage
