"""Numerics 1: observers and predictors as they were before `control.elementary`, for recordings of then.

A recording without a version of its numerics was made by the functions here: those of libm, R1 with f11 and
f21, gains by 1 - 2 q + m, the matrix exponential of numpy. They stay as they were, so that it replays to the
bit; nothing else uses them. What both numerics have in common is imported.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.control.numerics_1.friction_kalman import FrictionKalman1, FrictionPredictor1
from dcmp_hil.control.numerics_1.super_twisting import LinearPredictor1, SuperTwisting1
from dcmp_hil.control.observers.friction_kalman.settings import FrictionKalmanSettings
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings

if TYPE_CHECKING:
    from dcmp_hil.control.observers import Observer, ObserverContext, Predictor


def observer_1(section: object, context: ObserverContext) -> Observer | None:
    """Return the observer of a table as numerics 1 has it; None where both numerics make the same."""
    if isinstance(section, SuperTwistingSettings):
        return SuperTwisting1(
            context, L1=section.L1_1_s, L2=section.L2_1_s2, M=section.M_rad_s3, mu0=section.mu0_rad_s
        )
    if isinstance(section, FrictionKalmanSettings):
        return FrictionKalman1(
            context,
            d_noise=section.d_noise,
            edge_counts=section.edge_counts,
            f1_uncertainty=section.f1_uncertainty,
        )
    return None


def predictor_1(
    observer: Observer, context: ObserverContext, delay_samples: int, *, measured: bool
) -> Predictor:
    """Return the predictor that goes with an observer; arguments as for `LinearPredictor`."""
    if isinstance(observer, FrictionKalman1):
        return FrictionPredictor1(observer, context, delay_samples, measured=measured)
    return LinearPredictor1(context.model, context.period, delay_samples, measured=measured)


__all__ = ["observer_1", "predictor_1"]
