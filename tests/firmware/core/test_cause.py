"""The causes of an end: three of them leave time to lead the voltage to 0 V, as in Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.safety.chatter import cause_of, chattering
from dcmp_hil.safety.limiter import astray, saturated
from dcmp_hil.safety.monitors import too_fast
from dcmp_hil.trip_request import Urgency
from tests.firmware.law import Law

if TYPE_CHECKING:
    from tests.firmware.bench import Core

LAST = 17
RAMPS = {
    15: astray(0.0, 0.0, 0.0, 0.0),
    16: saturated(0.0, 0.0, 0.0),
    17: chattering(0.0, 0.0, 0.0, lambda: cause_of((), 0.0)),
}


def test_what_leaves_time_has_the_urgency_of_python(core: Core) -> None:
    found = Law(core)("leaves_time", np.arange(LAST + 1.0))
    assert np.flatnonzero(found).tolist() == sorted(RAMPS)
    assert {each.urgency for each in RAMPS.values()} == {Urgency.RAMP}
    assert too_fast(0.0, 1.0, 0.5).urgency is Urgency.NOW
