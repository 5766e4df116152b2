"""Checks of a device's parameters, for plausibility and against the rig."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.wire.messages import Parameter

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.device.device_config import DeviceConfig

_INT32_MAX = 2**31 - 1
PARAMETER_RANGES = {
    Parameter.BOARD: (0, _INT32_MAX),
    Parameter.BOOT_COUNT: (0, _INT32_MAX),
    Parameter.RESET_CAUSE: (0, _INT32_MAX),
    Parameter.TICK: (0, _INT32_MAX),
    Parameter.COUNTS_PER_REV: (1, 2**24),
    Parameter.PERIOD_US: (50, 100_000),
    Parameter.VOLTAGE_LIMIT_MV: (1, 32_767),
    Parameter.SLEW_MV_PER_MS: (0, _INT32_MAX),
    Parameter.WATCHDOG_MS: (5, 50),
    Parameter.SPEED_LIMIT_COUNTS_S: (1, _INT32_MAX),
    Parameter.TRAVEL_LIMIT_COUNTS: (1, _INT32_MAX),
    Parameter.EDGE_STAMPS: (0, 1),
    Parameter.LAST_FAULT: (0, 255),
    Parameter.LAST_FAULT_DETAIL: (-_INT32_MAX - 1, _INT32_MAX),
    Parameter.SUPPLY_MV: (0, _INT32_MAX),
    Parameter.TRAVEL_ORIGIN_COUNTS: (-1, 2**24 - 1),
}
"""What a value can be at all, both ends included."""
COMPARED_PARAMETERS = (
    Parameter.COUNTS_PER_REV,
    Parameter.PERIOD_US,
    Parameter.VOLTAGE_LIMIT_MV,
    Parameter.SLEW_MV_PER_MS,
    Parameter.SPEED_LIMIT_COUNTS_S,
    Parameter.TRAVEL_LIMIT_COUNTS,
    Parameter.SUPPLY_MV,
)


def is_possible(parameter: Parameter, value: int) -> bool:
    """Whether a parameter can have that value on any device."""
    lowest, highest = PARAMETER_RANGES[parameter]
    return lowest <= value <= highest


def differences(config: DeviceConfig, device: Mapping[Parameter, int]) -> list[str]:
    """Return the differences of device and rig, each with its remedy.

    Parameters
    ----------
    config
        What the rig says.
    device
        The values of COMPARED_PARAMETERS, all of them possible.
    """
    return [sentence for sentence in (*_same(config, device), *_limits(config, device)) if sentence]


def remarks(config: DeviceConfig, device: Mapping[Parameter, int]) -> list[str]:
    """Return remarks on properties of the device that the rig does not state and does not need."""
    slew = device[Parameter.SLEW_MV_PER_MS]
    sentence = (
        f"amplifier.slew_V_s: the rig says none, the device changes its voltage by {slew:g} V/s at most. Put "
        "that into the rig, and the loop reckons with it."
    )
    return [sentence] if slew and config.slew_mV_per_ms is None else []


def _same(config: DeviceConfig, device: Mapping[Parameter, int]) -> list[str]:
    counts = device[Parameter.COUNTS_PER_REV]
    rate_hz, asked_hz = 1e6 / device[Parameter.PERIOD_US], 1e6 / config.period_us
    found = [_supply(config.supply_mV, device[Parameter.SUPPLY_MV])]
    if counts != config.counts_per_rev:
        found.append(
            f"encoder.counts_per_rev: the rig says {config.counts_per_rev}, the device {counts}. "
            "Correct the rig, or build the firmware for this encoder."
        )
    if rate_hz != asked_hz:
        found.append(
            f"loop.rate_hz: the rig says {asked_hz:g}, the device {rate_hz:g}. "
            "Correct the rig, or build the firmware for this rate."
        )
    return found


def _supply(asked_mV: int, found_mV: int) -> str:
    """Return a fault if rig and board have different supplies: every voltage is wrong by their ratio."""
    if found_mV == asked_mV:
        return ""
    rig = f"{1e-3 * asked_mV:g}" if asked_mV else '"none"'
    if not found_mV:
        return (
            f"amplifier.supply_V: the rig says {rig}, but this board divides no supply: its amplifier is "
            'told a voltage. Take the key out of the rig, or write "none".'
        )
    return (
        f"amplifier.supply_V: the rig says {rig}, the board puts out a part of a supply that it takes for "
        f"{1e-3 * found_mV:g} V (PWM). Measure the motor's supply. If the board is right, write that into "
        "the rig; if not, flash its record anew with --supply-V."
    )


def _limits(config: DeviceConfig, device: Mapping[Parameter, int]) -> list[str]:
    """Return the limits of the device that are below the rig's.

    Travel as the board was built with it counts from where the device was armed first: with a zero that is
    a count that may be half a turn from hanging.
    """
    rad = math.tau / device[Parameter.COUNTS_PER_REV]
    away = 0.0 if config.zero is None else math.pi
    limits: list[tuple[str, float | None, float]] = [
        (
            "amplifier.voltage_limit_V",
            1e-3 * config.voltage_limit_mV,
            1e-3 * device[Parameter.VOLTAGE_LIMIT_MV],
        ),
        (
            "supervisor.velocity_limit_rad_s",
            config.velocity_limit,
            _rounded_down(rad * device[Parameter.SPEED_LIMIT_COUNTS_S]),
        ),
        (
            "supervisor.position_limit_rad",
            config.position_limit,
            _rounded_down(rad * device[Parameter.TRAVEL_LIMIT_COUNTS] - away),
        ),
    ]
    slew = device[Parameter.SLEW_MV_PER_MS]
    if slew:
        limits.append(("amplifier.slew_V_s", config.slew_mV_per_ms, slew))
    return [
        f"{key}: the rig says {asked:g}, the device allows {allowed:g}. Lower it in the rig."
        for key, asked, allowed in limits
        if asked is not None and _rounded_down(asked) > allowed
    ]


def _rounded_down(value: float) -> float:
    """Return a limit that can be written as it is printed."""
    return math.floor(1e3 * value + 1e-6) / 1e3
