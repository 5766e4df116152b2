"""Build configuration of a rig's board: `struct dcmp_config` of the firmware, field by field."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from dcmp_hil.config import Rig

SIMULATED, NATIVE = 1, 2  # the parameter BOARD
FIRMWARE_VERSION = 0x0001  # 0.1
_WATCHDOG_MS = 20
_WATCHDOG_MAX_MS = 50  # of the protocol
_SPEED_LIMIT_REV_S, _TRAVEL_LIMIT_REV = 8, 4  # the board's own limits: revolutions either way
_VOLTAGE_MAX_MV = 32_767  # what the wire can say


LAYOUT = struct.Struct("@13iHB?")
"""Of `struct dcmp_config`: the values of `board_config`, in their order."""


def _watchdog_ms(rig: Rig, board: int) -> int:
    """Return the longest that a host may ask for.

    A virtual board allows what any device may, so that it fits every rig; a real one is built for its own.
    """
    if board in (SIMULATED, NATIVE):
        return _WATCHDOG_MAX_MS
    return getattr(rig.backend, "watchdog_ms", _WATCHDOG_MS)


def board_config(rig: Rig, board: int) -> dict[str, int]:
    """Return the fields by name, for a board that fits the rig.

    Raises
    ------
    ConfigError
        If no board can be like that.
    """
    impossible = rig.impossible_on_a_wire
    if impossible:
        raise ConfigError(
            f"{', '.join(impossible)}: no device has that, not even a virtual one. "
            "Start from the rig bench-1khz."
        )
    counts = round(rig.encoder.counts or 0)
    slew = rig.amplifier.slew
    return {
        "board": board,
        "boot_count": 1,
        "reset_cause": 1,  # power
        "counts_per_rev": counts,
        "period_us": round(1e6 * rig.period),
        "voltage_limit_mV": round(min(1e3 * rig.amplifier.limit, _VOLTAGE_MAX_MV)),
        "slew_mV_per_ms": 0 if math.isinf(slew) else max(1, round(slew)),
        "watchdog_ms": _watchdog_ms(rig, board),
        "speed_limit_counts_s": _SPEED_LIMIT_REV_S * counts,
        "travel_limit_counts": _TRAVEL_LIMIT_REV * counts,
        "last_fault": 0,
        "last_fault_detail": 0,
        "supply_mV": rig.amplifier.supply_mV,
        "firmware_version": FIRMWARE_VERSION,
        "node": getattr(rig.backend, "node", 0),
        "edge_stamps": 0,
    }
