"""Meaning of a device's faults, and a remedy for each."""

from __future__ import annotations

from typing import NamedTuple

from dcmp_hil.values import Fault


class Meaning(NamedTuple):
    """A fault in words."""

    sentence: str
    remedy: str


_FAULT_MEANINGS = {
    Fault.HOST_SILENT: Meaning(
        "The device heard no valid command for longer than its watchdog allows",
        "The computer was too busy, or commands arrive damaged or too late: close other programs, look at "
        "the lateness in the summary, or raise backend.watchdog_ms (at most 50).",
    ),
    Fault.LINK_DOWN: Meaning("The line to the device hung up", "Look at cable, adapter and bus termination."),
    Fault.STOPPED: Meaning("STOP was sent to the device", "Find out who and why before you start again."),
    Fault.CORRUPT_LINK: Meaning(
        "10 of the last 100 frames at the device were damaged",
        "Look at cable, ground and termination; lower the baud rate.",
    ),
    Fault.OVER_SPEED: Meaning(
        "The arm turned faster than the firmware's own limit",
        "Look at the signs of motor and encoder, the reference and the gains.",
    ),
    Fault.OVER_TRAVEL: Meaning(
        "The arm went further than the firmware's own limit",
        "Bring it back by hand; look at the reference and at encoder.zero.",
    ),
    Fault.ENCODER_JUMP: Meaning(
        "The encoder's count jumped", "Look at its cable, shield and supply, and at counts_per_rev."
    ),
    Fault.BREAK_INPUT: Meaning(
        "The amplifier's own protection acted", "Look at motor current, temperature and supply."
    ),
    Fault.INTERNAL: Meaning(
        "The board found something wrong with itself",
        "firmware/README.md says what its detail means: 1 no crystal, 2 no record written, ...",
    ),
    Fault.TWO_DEVICES: Meaning(
        "Two devices send under this node: one is in RUN, the other is not",
        "Unplug one, or build its firmware with another node (backend.node then says which of them to run).",
    ),
    Fault.DISARMED: Meaning(
        "The device left RUN by itself and names no fault, as after a reset",
        "Look at its supply (brown-out?) and at its reset button.",
    ),
}


def meaning_of(code: int) -> Meaning:
    """Return a fault in words, for any code.

    Parameters
    ----------
    code
        A Fault, or a number that this version does not know.
    """
    unknown = Meaning(
        f"The device reports fault {code}, which this version does not know",
        "Look it up in the firmware's own list, mend the cause, then start again.",
    )
    return _FAULT_MEANINGS.get(Fault(code), unknown) if code in set(Fault) else unknown


def name_of(code: int) -> str:
    """Return the name of a fault, or its number where this version has no name for it."""
    return Fault(code).name if code in set(Fault) else f"code {code}"
