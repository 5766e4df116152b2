"""A known part of the disturbance: Coulomb friction by the sign of the reference's velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.control.observers import Observer, ObserverContext
    from dcmp_hil.control.observers.super_twisting import Tuning
    from dcmp_hil.trip_request import TripRequest
    from dcmp_hil.values import Estimate, Reference, Sample

_CROSSING_RAD_S = 0.005  # the sign is a ramp inside it, so that the voltage stays continuous


class KnownFriction:
    """Any observer, relieved of the jump of 2 f1 at every reversal (`controller.friction_feedforward`).

    The observer is told of friction as of an input that is known, -f1 sat(x_r' / 0.005 rad/s), and so has
    only the rest of w to find; what is reported, and compensated, is the whole w.

    Parameters
    ----------
    observer
        The one that finds the rest.
    context
        The rig served.
    reference
        The trajectory at any instant.
    ahead
        s, from a sample to the instant at which its command takes effect.
    """

    def __init__(
        self,
        observer: Observer,
        context: ObserverContext,
        reference: Callable[[float], Reference],
        ahead: float,
    ) -> None:
        self._observer = observer
        self._f1, self._volts = context.model.f1, 1.0 / context.model.ku
        self._reference = reference
        self._ahead = ahead
        self._t = 0.0

    def update(self, sample: Sample) -> Estimate:
        """Return the estimate with the friction that will act when the command does."""
        held = self._friction(0.5 * (sample.t + self._t)) if sample.t > self._t else 0.0
        self._t = sample.t
        rest = self._observer.update(sample._replace(voltage=sample.voltage + held * self._volts))
        return rest._replace(disturbance=rest.disturbance + self._friction(sample.t + self._ahead))

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:
        """Object if an observer of the user's own has failed."""
        check: Callable[[Sample, Estimate], TripRequest | None] | None = getattr(
            self._observer, "check", None
        )
        return check(sample, estimate) if check else None

    def retune(self, tuning: Tuning) -> None:
        """Retune the inner observer, which estimates the rest of the disturbance."""
        self._observer.retune(tuning)  # type: ignore[attr-defined]

    def _friction(self, t: float) -> float:
        """Return the friction believed to act at `t`, rad/s2."""
        slope = self._reference(t).velocity / _CROSSING_RAD_S
        return -self._f1 * max(-1.0, min(1.0, slope))
