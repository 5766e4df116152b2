"""Settings common to host and device, and conversion of the wire's integers to radians and volts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dcmp_hil.config.backends import Device
from dcmp_hil.errors import ConfigError
from dcmp_hil.safety.speed_resolution import resolution

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

_VOLTAGE_MAX_MV = 32_767  # mV: what the wire can say
_PARAMETER_MAX = 2**31 - 1


@dataclass(frozen=True, slots=True)
class DeviceConfig:
    """The settings of a rig that concern its device.

    Parameters
    ----------
    node
        Of the device on its bus.
    counts_per_rev
        Counts, must be the device's own.
    period_us
        us, must be the device's own.
    voltage_limit_mV
        mV, either way; the device's own, or lower.
    slew_mV_per_ms
        mV per ms; None leaves the device's own.
    watchdog_ms
        ms, 5 to 50.
    rad_per_count
        rad, signed by the encoder's wiring.
    mV_per_V
        1000, signed by the amplifier's wiring.
    supply_mV
        mV, of the motor, where the board divides it; must be the device's own. 0 where it does not.
    zero
        Count at which the arm hangs; None for where it is at the start.
    velocity_limit, position_limit
        rad/s and rad either way, at which the host ends a run; None where it watches neither.
    speed_limit_counts_s, travel_limit_counts
        The same for the device, which keeps them whether the host watches or not. Speed is one count in 8 ms
        higher there: noise of half a count is no speed, and the host's watch comes first.
    boot_wait
        s, for the first sample.
    warn_share, warn_clock_share
        Above which losses, and an error of the device's clock, are told.
    """

    node: int
    counts_per_rev: int
    period_us: int
    voltage_limit_mV: int
    slew_mV_per_ms: int | None
    watchdog_ms: int
    rad_per_count: float
    mV_per_V: float
    supply_mV: int
    zero: int | None
    velocity_limit: float | None
    position_limit: float | None
    speed_limit_counts_s: int
    travel_limit_counts: int
    boot_wait: float
    warn_share: float
    warn_clock_share: float

    @classmethod
    def of(cls, rig: Rig) -> DeviceConfig:
        """Read them from a rig whose backend is a device.

        Raises
        ------
        ConfigError
            If the rig has no device on a wire.
        """
        device, counts = rig.backend, rig.encoder.counts
        if not isinstance(device, Device) or counts is None:
            raise ConfigError(
                f'backend.kind: got "{device.kind}"; expected a device on a wire, such as "serial".'
            )
        slew, limits = rig.amplifier.slew, rig.supervisor
        watched = limits.monitors == "all"
        spare = resolution(math.tau / counts, rig.period)  # the device knows nothing of an encoder's noise
        return cls(
            node=device.node,
            counts_per_rev=round(counts),
            period_us=round(1e6 * rig.period),
            voltage_limit_mV=round(min(1e3 * rig.amplifier.limit, _VOLTAGE_MAX_MV)),
            slew_mV_per_ms=None if math.isinf(slew) else max(1, round(slew)),
            watchdog_ms=device.watchdog_ms,
            rad_per_count=rig.encoder.sign * math.tau / counts,
            mV_per_V=1e3 * rig.amplifier.sign,
            supply_mV=rig.amplifier.supply_mV,
            zero=None if rig.encoder.zero == "at_start" else rig.encoder.zero,
            velocity_limit=limits.velocity_limit_rad_s if watched else None,
            position_limit=limits.position_limit_rad if watched else None,
            speed_limit_counts_s=_counts(limits.velocity_limit_rad_s + spare, counts),
            travel_limit_counts=_counts(limits.position_limit_rad, counts),
            boot_wait=device.boot_wait_s,
            warn_share=1e-2 * device.warn_percent,
            warn_clock_share=1e-2 * device.warn_clock_percent,
        )


def _counts(limit: float, counts_per_rev: float) -> int:
    """Return a limit in radians in whole counts, never above it unless it is below one."""
    return max(1, min(math.floor(limit * counts_per_rev / math.tau), _PARAMETER_MAX))
