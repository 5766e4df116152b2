"""Section 8 with --arm: limits that a session sets."""

from __future__ import annotations

import statistics
from itertools import pairwise
from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.checks.running import PUSH_VOLTAGE_MV, lower
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import FaultReport, Parameter, State
from dcmp_hil.wire.wrapping import unwrap

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from dcmp_hil.conformance.client import Client
    from dcmp_hil.conformance.listener import Seen

_SPEED_WINDOW_MS, _MOVEMENT_TOLERANCE_COUNTS = 8.0, 1
"""ms that a session's speed limit is taken over, and counts that may show more than it says."""
_COUNTS = 2**24
_FAR_COUNTS, _TRAVEL_LIMIT_COUNTS = 1000, 500
"""Counts from the arm to an origin, and a travel limit that it does not reach."""


def _first_too_fast(client: Client, seen: Sequence[Seen], limit: int) -> int | None:
    """Return the tick at which section 8 finds the speed too high; None if it does at none.

    Raises
    ------
    NotJudgedError
        If a SAMPLE is missing among these.
    """
    if any(new.tick != old.tick + 1 for old, new in pairwise(seen)):
        raise NotJudgedError("a SAMPLE was lost")
    counts: list[int] = []
    for one in seen:
        counts.append(unwrap(counts[-1] if counts else 0, one.sample.position_counts, 24))
    periods = client.periods(_SPEED_WINDOW_MS)
    for end in range(periods + 2, len(counts)):
        moved = statistics.median(counts[end - k] - counts[end - k - periods] for k in range(3))
        too_fast = (abs(moved) - _MOVEMENT_TOLERANCE_COUNTS) * 1_000_000 > limit * periods * client.period_us
        if too_fast and seen[end].sample.state in (State.RUN, State.FAULT):
            return seen[end].tick
    return None


def speed(client: Client) -> Iterator[str]:
    """Push the arm, softly at first, under a speed limit of one count a second."""
    session = client.own()
    limit = 1
    lower(client, session, Parameter.SPEED_LIMIT_COUNTS_S, limit)
    client.drain()
    client.listen(client.periods(12))
    first, at = len(client.samples) - client.periods(12), len(client.heard)
    client.arm(session)
    ramp = client.periods(300)
    for i in range(ramp):
        client.newest()
        if client.state != State.RUN:
            break
        client.drive(session, PUSH_VOLTAGE_MV * i // ramp, arm=True)
    client.answer(3, session, 0)
    seen = client.samples[first:]
    due = _first_too_fast(client, seen, limit)
    fault = next((one.tick for one in seen if one.sample.state == State.FAULT), None)
    report = next((one for one in client.heard[at:] if isinstance(one, FaultReport)), None)
    if due is None and fault is None:
        raise NotJudgedError(f"the arm does not move at {PUSH_VOLTAGE_MV} mV")
    if fault is None:
        yield f"under a speed limit of {limit} count/s the encoder moved, without a fault"
    elif report is not None and report.code != Fault.OVER_SPEED:
        yield f"a speed limit of {limit} count/s led to fault {report.code}, the page says 5"
    elif due is None or fault != due:
        found = "at no tick" if due is None else f"at tick {due & 255}"
        yield (
            f"under a speed limit of {limit} count/s FAULT(OVER_SPEED) came at tick {fault & 255}; by the "
            f"counts of its SAMPLEs it is due {found}: the change over 8 ms"
        )


def origin(client: Client) -> Iterator[str]:
    """Arm with an origin from which the arm is too far away, and with one from which it is not."""
    if client.value(Parameter.TRAVEL_LIMIT_COUNTS) < _TRAVEL_LIMIT_COUNTS:
        raise NotJudgedError(f"the board was built with a travel limit below {_TRAVEL_LIMIT_COUNTS} counts")
    limit = f"a limit of {_TRAVEL_LIMIT_COUNTS}"
    for away, too_far in (
        (_TRAVEL_LIMIT_COUNTS // 2, False),
        (-_TRAVEL_LIMIT_COUNTS // 2, False),
        (_FAR_COUNTS, True),
        (-_FAR_COUNTS, True),
    ):
        session = client.own()
        lower(client, session, Parameter.TRAVEL_LIMIT_COUNTS, _TRAVEL_LIMIT_COUNTS)
        here = client.newest().sample.position_counts
        lower(client, session, Parameter.TRAVEL_ORIGIN_COUNTS, (here + away) % _COUNTS)
        at = len(client.heard)
        _try_to_arm(client, session)
        client.answer(3, session, 0)
        report = next((one for one in client.heard[at:] if isinstance(one, FaultReport)), None)
        if too_far and report is None:
            yield f"armed {_FAR_COUNTS} counts from TRAVEL_ORIGIN_COUNTS the device runs, under {limit}"
        elif too_far and report is not None and report.code != Fault.OVER_TRAVEL:
            yield f"armed too far from TRAVEL_ORIGIN_COUNTS it says fault {report.code}, the page says 6"
        elif too_far and report is not None and abs(report.detail + away) > 2:  # noqa: PLR2004 - it trembles
            yield f"FAULT(OVER_TRAVEL) says {report.detail} counts, {-away} from TRAVEL_ORIGIN_COUNTS"
        elif not too_far and report is not None:
            yield f"armed {away} counts from TRAVEL_ORIGIN_COUNTS it faults, under {limit}"
        _leave(client, session)


def _try_to_arm(client: Client, session: int) -> None:
    for _ in range(4 * client.periods(500)):
        client.newest()
        if client.state in (State.RUN, State.FAULT):
            return
        client.drive(session, arm=True)
    raise NotJudgedError("the device did not come to RUN")


def _leave(client: Client, session: int) -> None:
    """Clear the fault, if there is one, and give the device back."""
    for clear in (False, True, False, True):
        client.newest()
        client.drive(session, clear=clear)
    for _ in range(20):
        client.newest()
        client.drive(session, release=True)
        found = client.hello()
        if found is not None and not found.busy:
            return
    raise NotJudgedError("a DRIVE with release = 1 does not end the ownership: `release` says more")


CHECKS = (
    DeviceCheck(
        "speed-limit",
        "8",
        "Speed over 8 ms beyond the limit that a session set leads to FAULT.",
        speed,
        needs_arm=True,
    ),
    DeviceCheck(
        "travel-origin", "8", "Travel counts from the origin that a session gave.", origin, needs_arm=True
    ),
)
