"""`[observer]` with `kind = "friction_kalman"`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from dcmp_hil.common.section import NotNegative, Positive
from dcmp_hil.control.observers.friction_kalman.observer import FrictionKalman, FrictionKalmanTuning
from dcmp_hil.control.observers.friction_kalman.predictor import FrictionPredictor
from dcmp_hil.control.observers.settings import ObserverSettings

if TYPE_CHECKING:
    from dcmp_hil.control.observers import Observer, ObserverContext, Predictor
    from dcmp_hil.control.observers.settings import ObserverLimits


class FrictionKalmanSettings(ObserverSettings):
    """`[observer]` with `kind = "friction_kalman"`."""

    kind: Literal["friction_kalman"]
    d_noise: Positive = 0.1
    """Noise of the disturbance, (rad/s2)2/s: higher follows a push faster, and is less quiet."""
    edge_counts: Positive = 0.13
    """Standard deviation of an edge of the encoder, counts."""
    f1_uncertainty: NotNegative = 0.25
    """Standard deviation of model.f1 at the start, rad/s2."""

    def build(self, context: ObserverContext) -> FrictionKalman:
        """Make the observer for a rig."""
        return FrictionKalman(
            context,
            d_noise=self.d_noise,
            edge_counts=self.edge_counts,
            f1_uncertainty=self.f1_uncertainty,
        )

    def predictor(
        self, observer: Observer, context: ObserverContext, delay_samples: int, *, measured: bool
    ) -> Predictor | None:
        """Make the predictor that goes on from the filter's state."""
        assert isinstance(observer, FrictionKalman)  # noqa: S101
        return FrictionPredictor(observer, context, delay_samples, measured=measured)

    @property
    def knows_friction(self) -> bool:
        """Whether the friction of `[model]` is part of the observer's own prediction."""
        return True

    @classmethod
    def tunable(cls) -> tuple[str, ...]:
        """Return the keys that may change in a run."""
        return ("d_noise", "edge_counts")

    @classmethod
    def at_start(cls) -> tuple[str, ...]:
        """Return the key of the variance that the friction level starts with."""
        return ("f1_uncertainty",)

    @classmethod
    def diagnosis(cls) -> tuple[str, ...]:
        """Return the names of the filter's own state, and of how far it is to be trusted."""
        return FrictionKalman.DIAGNOSIS

    def tuning(self, context: ObserverContext) -> FrictionKalmanTuning:  # noqa: ARG002
        """Return what the observer is retuned with."""
        return FrictionKalmanTuning(self.d_noise, self.edge_counts)

    def fault(self, context: ObserverContext, limits: ObserverLimits) -> str:  # noqa: ARG002
        """Return a fault on an ideal encoder, which has no edges."""
        if context.counts_per_rev is not None:
            return ""
        return (
            "friction_kalman measures by the edges of an encoder, and this one is ideal. Set "
            'encoder.counts_per_rev, or observer.kind = "super_twisting".'
        )
