"""Expected variation of a rig's voltage, caused by its encoder, its gains and its reference."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.config.gain_rules import loops
from dcmp_hil.control.controllers.pd_compensated import PdSettings
from dcmp_hil.control.observers.super_twisting import SuperTwistingSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.config.rig import Rig
    from dcmp_hil.control.references import ReferenceSettings

_VARIATION_RATIO = 10.0
"""Times the rule's, that the paper's Euler steps and an observer of one's own may cost."""
_HORIZON_S = 60.0  # of the reference
_WINDOW_S = 0.5  # of one window
_WINDOW_COUNT = 120  # in the horizon
_POINTS_PER_WINDOW = 30  # instants in each window


def expected_variation(rig: Rig) -> float:
    """Return the mean of |dV/dt| that gains, encoder and reference explain, V/s.

    The gains are judged by the linear loop. A controller of one's own is taken for the one of the default
    gains; the paper's observer, and one of one's own, for ten times as rough as `super_twisting` by its rule.
    """
    usual: dict[str, object] = {}
    if not isinstance(rig.controller, PdSettings):
        usual["controller"] = PdSettings(position=getattr(rig.controller, "position", "estimated"))
    rough = not isinstance(rig.observer, SuperTwistingSettings)
    if rough:
        usual["observer"] = SuperTwistingSettings()
    found = [loop.variation_V_s() for loop in loops(rig.model_copy(update=usual))]
    noise = max((one for one in found if math.isfinite(one)), default=0.0)
    return (_VARIATION_RATIO if rough else 1.0) * noise + _of_reference(rig)


def _of_reference(rig: Rig) -> float:
    """Return the largest mean of |dV/dt| in a window that following the reference takes, V/s."""
    model, limit, step = rig.model.values(), rig.amplifier.limit, rig.period
    sine, v, a = _instants(rig.reference, step)
    volts = (a + model.f0 * v + model.gravity * sine) / model.ku
    bounded = np.maximum(-limit, np.minimum(limit, volts))
    changes = np.abs(bounded[1] - bounded[0])
    total = np.zeros(_WINDOW_COUNT)
    for instant in changes.T:  # one after the other: the same bits on every computer
        total = total + instant
    means = total / (_POINTS_PER_WINDOW * step)
    most = max(0.0, float(means.max()))
    return most if math.isfinite(most) else 0.0


@lru_cache(maxsize=16)  # one reference serves thousands of runs of a sweep
def _instants(reference: ReferenceSettings, step: float) -> NDArray[np.float64]:
    """Return sin x, v and a of a reference, shape (3, 2, windows, points): at instants and a period later."""
    found = np.empty((3, 2, _WINDOW_COUNT, _POINTS_PER_WINDOW))
    for window in range(_WINDOW_COUNT):
        begin = window * _HORIZON_S / _WINDOW_COUNT
        for k in range(_POINTS_PER_WINDOW):
            t = begin + k * _WINDOW_S / _POINTS_PER_WINDOW
            for later, instant in enumerate((t, t + step)):
                x, v, a = reference.at(instant)
                found[:, later, window, k] = math.sin(x), v, a
    return found
