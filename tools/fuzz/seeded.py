"""Errors that the fuzz target has to find: each is one place of the core, with the executions it may take.

`within` is at least four times what the worst of five seeds took; tests/firmware/test_fuzz.py walks them all.
"""

from __future__ import annotations

from typing import NamedTuple

from tools.fuzz.build import Edit


class Seeded(NamedTuple):
    """An error, what is wrong with it, and the executions within which it is found."""

    says: str
    edit: Edit
    within: int


ERRORS: dict[str, Seeded] = {
    "voltage-outside-run": Seeded(
        "what takes the voltage away after a change of state does nothing",
        Edit("dcmp_guard.c", "dcmp_amplifier_cut(&device->amplifier);", "(void)device;"),
        100_000,
    ),
    "longer-of-two-watchdogs": Seeded(
        "a DRIVE's ttl_ms lengthens the watchdog, and does not shorten it",
        Edit("dcmp_watchdog.c", "ttl_ms < watchdog_ms", "ttl_ms > watchdog_ms"),
        100_000,
    ),
    "repeated-drive": Seeded(
        "a DRIVE with the seq of the one before is accepted",
        Edit("dcmp_session.c", "(step == 0u || step > DCMP_SEQ_NEWER_MAX)", "step > DCMP_SEQ_NEWER_MAX"),
        100_000,
    ),
    "clear-without-edge": Seeded(
        "a fault is cleared by a `clear` that no DRIVE without it came before",
        Edit("dcmp_supervisor.c", " && supervisor->lowered", ""),
        100_000,
    ),
    "eleventh-corrupt-frame": Seeded(
        "the link is given up at eleven corrupt frames among 100, not at ten",
        Edit("dcmp_health.c", "count >= DCMP_CORRUPT_LIMIT", "count > DCMP_CORRUPT_LIMIT"),
        100_000,
    ),
    "slew-one-way": Seeded(
        "a voltage falls twice as fast as the slew allows",
        Edit("dcmp_amplifier.c", "wanted_uV >= -reach_uV", "wanted_uV >= -2 * reach_uV"),
        100_000,
    ),
    "limits-outlive-owner": Seeded(
        "a new owner finds the limits that the one before had set",
        Edit("dcmp_guard.c", "dcmp_parameters_restore(&device->parameters);", ""),
        100_000,
    ),
    "origin-forgotten": Seeded(
        "the origin of travel that a session gives is not looked at",
        Edit("dcmp_guard.c", "if (origin != DCMP_FIRST_ARMING) {", "if (origin > 0x7FFFFFFE) {"),
        100_000,
    ),
    "two-counts-in-8-ms": Seeded(
        "speed over 8 ms is found a count too late",
        Edit("dcmp_encoder.c", "/ period_us, 1, period_us)", "/ period_us, 2, period_us)"),
        1_000_000,
    ),
    "raised-watchdog": Seeded(
        "the watchdog's time may be raised above what the board was built with",
        Edit(
            "dcmp_parameters.c",
            "DCMP_WATCHDOG_MIN_MS, config->watchdog_ms);",
            "DCMP_WATCHDOG_MIN_MS, DCMP_WATCHDOG_MAX_MS);",
        ),
        100_000,
    ),
    "one-byte-too-many": Seeded(
        "a COBS frame without an end is written a byte past its buffer",
        Edit("dcmp_cobs.c", "cobs->length == sizeof cobs->bytes", "cobs->length > sizeof cobs->bytes"),
        100_000,
    ),
    "travel-from-the-last-arming": Seeded(
        "travel is counted from the newest arming, not from the first",
        Edit("dcmp_encoder.c", "if (!encoder->anchored) {", "if (true) {"),
        100_000,
    ),
}
