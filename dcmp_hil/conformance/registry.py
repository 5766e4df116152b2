"""Every check, in the order in which they run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.conformance.checks import (
    arming,
    carriers,
    drives,
    faults,
    frames,
    limits,
    parameters,
    running,
    sessions,
    timing,
    watchdog,
)

if TYPE_CHECKING:
    from dcmp_hil.conformance.check import DeviceCheck

CHECKS: tuple[DeviceCheck, ...] = (
    *frames.CHECKS,
    *carriers.CHECKS,
    *timing.CHECKS,
    *sessions.CHECKS,
    *drives.CHECKS,
    *faults.CHECKS,
    *parameters.CHECKS,
    *arming.CHECKS,
    *running.CHECKS,
    *limits.CHECKS,
    *watchdog.CHECKS,
)
