"""End of a run's process, as the telemetry process sees it: in order, by STOP, or without a report."""

from __future__ import annotations

from typing import NamedTuple

from dcmp_hil.ipc.child_process import parent_lives
from dcmp_hil.ipc.run_end import FORCED, RUN_CODES, end_in
from dcmp_hil.platform.clock import MonotonicClock, pause

_EXIT_TIMEOUT_S = 5.0  # s for a process whose line has gone to be gone as well
_POLL_PERIOD_S = 0.002  # s


class Death(NamedTuple):
    """In a word that stays the same, and in a sentence."""

    word: str
    sentence: str


_FORCED = Death(
    "STOP_FORCED",
    "STOP: the run did not answer and was ended by force; the device goes to 0 V by its watchdog. Look for a "
    "loop or a wait without end in the class of your own.",
)
_DIED = Death(
    "died",
    "The run's process ended without a word; the device goes to 0 V by its watchdog. It was killed, or a "
    "class of your own ended it.",
)


def how_it_died(mailbox: int | None, parent: int) -> Death | None:
    """Return how the run's process died; None if it lives, and has closed its line in order.

    Parameters
    ----------
    mailbox
        Descriptor of the memory in which the run says how it ended; None if it does not.
    parent
        Its process id.
    """
    if mailbox is None:
        return None if parent_lives(parent) else _DIED
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(_EXIT_TIMEOUT_S * 1e9)
    while parent_lives(parent):
        if end_in(mailbox) in RUN_CODES or clock.now_ns() > end_ns:
            return None
        pause(_POLL_PERIOD_S)
    return _FORCED if end_in(mailbox) == FORCED else _DIED
