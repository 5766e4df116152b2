"""STOP: asked for in the mailbox, confirmed by the last words of the loop, or forced, within a second.

The request comes from outside of the run's process: what runs there may be stuck, and may ignore signals.
"""

from __future__ import annotations

import os
import signal
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.ipc.mailbox import STOP_REQUEST
from dcmp_hil.ipc.run_end import AT_ZERO, NOT_ARMED, RUN_CODES
from dcmp_hil.platform.clock import MonotonicClock, pause

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.ipc.mailbox import Mailbox

STOP_TIME_MAX_S = 1.0
"""s, within which STOP is confirmed or told as failed."""
_NOT_TAKEN_SCHEDULE_S = (0.25, signal.SIGINT), (0.40, signal.SIGTERM), (0.60, signal.SIGKILL)
_SIGNAL_SCHEDULE_S = (0.50, signal.SIGINT), (0.60, signal.SIGTERM), (0.80, signal.SIGKILL)
"""s from STOP to each signal; a loop that has taken it has the time that a device takes to confirm 0 V."""
_STOP_WAIT_MAX_S = 0.95  # s
_POLL_PERIOD_S = 0.002  # s


class End(StrEnum):
    """Kinds of end of a run after STOP."""

    CONFIRMED = "confirmed"  # at 0 V for sure
    UNCONFIRMED = "unconfirmed"  # the run ended, and the device did not say that it is at 0 V
    FORCED = "forced"  # the run did not answer and was ended by a signal
    FAILED = "failed"  # it goes on


class Stopped(NamedTuple):
    """Result of STOP: a fixed word, and a sentence."""

    end: End
    said: str


def stop_run(
    pid: int,
    mailbox: Mailbox,
    alive: Callable[[], bool],
    *,
    watchdog: str = "",
    by: int = STOP_REQUEST,
    late: float = 0.0,
) -> Stopped:
    """Ask for the end of a run and wait for its last words; where none come, end it by force.

    Parameters
    ----------
    pid
        Of the run's process.
    mailbox
        The way to its loop.
    alive
        Whether that process is still the run, and is not gone.
    watchdog
        What bounds the time that the device takes to 0 V by itself: "within 20 ms".
    by
        The signal that asks, where one does.
    late
        s, that have passed since the end was asked for in another way.
    """
    clock = MonotonicClock()
    began_ns = clock.now_ns()
    sent: list[signal.Signals] = []
    mailbox.ask_stop(by)
    while True:
        after = late + 1e-9 * (clock.now_ns() - began_ns)
        if mailbox.ended:
            return _last_words(mailbox, after)
        if not alive():  # it may have said so meanwhile
            return (
                _gone(sent, after, watchdog) if mailbox.end not in RUN_CODES else _last_words(mailbox, after)
            )
        if after > _STOP_WAIT_MAX_S:
            return _failed(pid)
        due = [
            number
            for at, number in (_SIGNAL_SCHEDULE_S if mailbox.stop_taken else _NOT_TAKEN_SCHEDULE_S)
            if at <= after
        ]
        for number in due[len(sent) :]:
            mailbox.tell_forced()
            with suppress(OSError):
                os.kill(pid, number)
            sent.append(number)
        if not mailbox.stop_taken:
            mailbox.ring_bell()
        pause(_POLL_PERIOD_S)


def is_alive(pid: int) -> bool:
    """Return whether a process is there and has not ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()
    except OSError:
        return False
    return fields[0] not in {"Z", "X"}


def _last_words(mailbox: Mailbox, after: float) -> Stopped:
    confirmed = mailbox.end in (AT_ZERO, NOT_ARMED)  # a run that has not armed the device moves nothing
    what = "confirmed" if confirmed else "the run ended"
    return Stopped(
        End.CONFIRMED if confirmed else End.UNCONFIRMED,
        f"{what} after {1e3 * after:.0f} ms: {mailbox.last_words}",
    )


def _gone(sent: list[signal.Signals], after: float, watchdog: str) -> Stopped:
    within = f" {watchdog}" if watchdog else ""
    went = f"the device goes to 0 V by its watchdog{within}"
    if not sent:
        return Stopped(End.UNCONFIRMED, f"the run's process ended without a word; {went}.")
    how = "was killed" if sent[-1] is signal.SIGKILL else f"was ended by {sent[-1].name}"
    return Stopped(End.FORCED, f"the run did not answer and {how} after {1e3 * after:.0f} ms; {went}.")


def _failed(pid: int) -> Stopped:
    return Stopped(
        End.FAILED,
        f"STOP is not confirmed: process {pid} cannot be ended, the kernel holds it. Switch the supply of "
        "the amplifier off.",
    )
