"""The scenarios of the traces: what section 8 of docs/protocol.md says, and what of 6 and 7 it needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tools.traces.command_scenarios import (
    arming,
    arming_gap,
    corrupt_link,
    gap,
    line_down,
    slew,
    stop_and_clear,
    watchdog,
)
from tools.traces.encoder_scenarios import (
    jumps,
    limits_end,
    over_speed,
    over_speed_low,
    over_speed_slow,
    over_travel,
    short_period,
    travel_built,
    travel_origin,
    wrap,
    wrong_count,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tools.traces.steps import Recorder

BUILT = {
    "counts_per_rev": 4096,
    "period_us": 1000,
    "voltage_limit_mV": 10_000,
    "slew_mV_per_ms": 0,
    "watchdog_ms": 20,
    "speed_limit_counts_s": 32_768,
    "travel_limit_counts": 16_384,
}
"""What the device is built with, unless a scenario says otherwise."""


class Scenario(NamedTuple):
    """A trace to be.

    Parameters
    ----------
    shows
        In a sentence.
    play
        What the host and the encoder do.
    built
        What differs from BUILT.
    """

    shows: str
    play: Callable[[Recorder], None]
    built: Mapping[str, int] = {}


SCENARIOS: dict[str, Scenario] = {
    "arming": Scenario("Ten DRIVEs lead to RUN; a clamp; 0 V at once at the end.", arming),
    "arming-gap": Scenario("Arming that is broken by a gap, a voltage, silence.", arming_gap),
    "gap": Scenario(
        "RUN without DRIVEs: the voltage is held; old, repeated and foreign ones are refused.", gap
    ),
    "watchdog": Scenario(
        "Silence in RUN: FAULT(HOST_SILENT) at a tick, and between two by ttl_ms.", watchdog
    ),
    "wrong-count": Scenario("One wrong count of any size is repaired; two are speed.", wrong_count),
    "jumps": Scenario("The third jump within 100 periods is ENCODER_JUMP.", jumps),
    "over-speed": Scenario("One count a period above the limit is OVER_SPEED, a tick later.", over_speed),
    "over-speed-2ms": Scenario("A speed that only twice the time shows.", over_speed_slow),
    "over-travel": Scenario(
        "Travel from the first arming on, over a second one.", over_travel, {"travel_limit_counts": 300}
    ),
    "over-speed-8ms": Scenario(
        "A speed limit of a session, too low for 1 and 2 ms: 8 ms show it.", over_speed_low
    ),
    "travel-origin": Scenario("Travel from an origin that a session gave.", travel_origin),
    "travel-built": Scenario(
        "For any origin of the session, the board's own limit counts from the first arming.",
        travel_built,
        {"travel_limit_counts": 300},
    ),
    "limits-end": Scenario("Limits of a session end with it.", limits_end),
    "wrap": Scenario("The count passes 2^24.", wrap),
    "stop-and-clear": Scenario("STOP; what clears a fault, and what does not.", stop_and_clear),
    "line-down": Scenario("The line hangs up in RUN and in ARMING.", line_down),
    "corrupt-link": Scenario("Ten corrupt frames among the last 100.", corrupt_link),
    "slew": Scenario("A slew limit of 150 mV/ms.", slew, {"slew_mV_per_ms": 150}),
    "period-250us": Scenario(
        "One count too many at a period of 250 us: speed is over four periods.",
        short_period,
        {"period_us": 250},
    ),
}
