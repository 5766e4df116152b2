"""Section 7 without a motor that moves: STOP in IDLE, FAULT, and the way out."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import FaultReport, SampleReport, State

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client

_STOP_REASON, _OTHER_STOP_REASON = 3, 1


def stopped(client: Client, reason: int = 0) -> None:
    """Send STOP and wait for FAULT.

    Raises
    ------
    NotJudgedError
        If it does not come: `stop` says more.
    """
    client.stop(reason)
    if client.settled_state() != State.FAULT:
        raise NotJudgedError("STOP does not lead to FAULT: `stop` says more")


def stop(client: Client) -> Iterator[str]:
    """Send STOP in IDLE, as a stranger, and listen to what the device says of it."""
    client.drain()
    at = len(client.heard)
    client.stop(_STOP_REASON)
    since = client.after_fence(len(client.samples))
    first = next((seen for seen in since if seen.sample.state == State.FAULT), None)
    if first is None:
        yield "STOP does not lead from IDLE to FAULT; it is obeyed from every host"
        return
    if first.sample.fault_class != Fault.STOPPED:
        yield f"SAMPLE says fault_class {first.sample.fault_class} after STOP, the page 3"
    if first.fault is None:
        yield "no FAULT came before the first SAMPLE that says FAULT"
    client.stop(_OTHER_STOP_REASON)
    client.listen(2 * client.periods(100) + 20)
    reports = [message for message in client.heard[at:] if isinstance(message, FaultReport)]
    wrong = [one for one in reports if (one.code, one.detail) != (Fault.STOPPED, _STOP_REASON)]
    if wrong:
        yield (
            f"FAULT says code {wrong[0].code}, detail {wrong[0].detail} after STOP with reason "
            f"{_STOP_REASON} and a second one with reason {_OTHER_STOP_REASON}; the first cause stays: "
            f"code 3, detail {_STOP_REASON}"
        )
    if reports and (reports[0].tick + 1) % 256 != first.tick % 256 and reports[0].tick != first.tick % 256:
        yield f"FAULT says tick {reports[0].tick}, the first SAMPLE that says FAULT is {first.tick % 256}"
    yield from _repeated(client, at)
    held = client.samples[-client.periods(100) :]
    if any(seen.sample.state != State.FAULT for seen in held):
        yield "the device left FAULT though no host cleared it"
    if any(seen.sample.voltage_mV for seen in held):
        yield "SAMPLE says a voltage other than 0 in FAULT"


def _repeated(client: Client, at: int) -> Iterator[str]:
    """Judge the distance of FAULTs by the SAMPLEs between them."""
    ticks, places = 0, []
    for message in client.heard[at:]:
        ticks += isinstance(message, SampleReport)
        if isinstance(message, FaultReport):
            places.append(ticks)
    steps = {new - old for old, new in pairwise(places)}
    every = client.periods(100)
    if len(places) < 3 or not steps <= {every - 1, every, every + 1}:  # noqa: PLR2004 - at once, 100, 200 ms
        yield (
            f"FAULT came {len(places)} times in {ticks} periods, {sorted(steps)} apart; it comes at once "
            f"and every {every}"
        )


def _drive_in_fault(client: Client, session: int, *, clear: bool, voltage_mV: int = 0) -> int:
    """Send a DRIVE that is accepted; return the state after it."""
    for _ in range(20):
        client.newest()
        mark = client.mark()
        client.drive(session, voltage_mV, clear=clear)
        if any(not seen.sample.missed for seen in client.after_fence(mark)):
            return client.state
    raise NotJudgedError("no DRIVE was accepted: `drive-accepted` says more")


def clear(client: Client) -> Iterator[str]:
    """Try each way that does not lead out of FAULT, then the one that does."""
    session = client.own()
    stopped(client)
    for word, voltage_mV, expected, wrong in (
        (True, 0, State.FAULT, "clear = 1 ends a fault without a DRIVE with clear = 0 since the fault"),
        (False, 0, State.FAULT, "a DRIVE with clear = 0 ends a fault"),
        (True, 1, State.FAULT, "clear = 1 with a voltage other than 0 ends a fault"),
        (True, 0, State.IDLE, "clear = 1 at 0 V after clear = 0 does not lead from FAULT to IDLE"),
    ):
        if _drive_in_fault(client, session, clear=word, voltage_mV=voltage_mV) != expected:
            yield wrong
            return
    stopped(client)
    if _drive_in_fault(client, session, clear=True) != State.FAULT:
        yield "a new fault is cleared by clear = 1 without a DRIVE with clear = 0 since that fault"


def of_one_session(client: Client) -> Iterator[str]:
    """Send DRIVE with clear = 0 from one host, and with clear = 1 from another."""
    first = client.own()
    stopped(client)
    for _ in range(20):
        client.newest()
        client.drive(first)
        client.newest()
        client.drive(first, release=True)
        client.listen(3)
        found = client.hello()
        if found is not None and not found.busy:
            break
    if client.state != State.FAULT:
        yield "a DRIVE with release = 1 leaves FAULT as it is, but the device left FAULT"
        return
    second = client.own()
    if client.state != State.FAULT:
        yield "a new owner finds the fault as it was, but the device left FAULT"
        return
    for _ in range(3):
        client.newest()
        client.drive(second, clear=True)
    if client.settled_state() != State.FAULT:
        yield "a fault was cleared by the DRIVEs of two sessions"


CHECKS = (
    DeviceCheck(
        "stop",
        "7",
        "STOP from any host leads to FAULT(STOPPED), said at once and every 100 ms; the first cause stays.",
        stop,
    ),
    DeviceCheck("clear", "7", "FAULT ends by clear = 0, then clear = 1, both at 0 V.", clear, timed=True),
    DeviceCheck(
        "clear-session", "7", "Both DRIVEs that clear a fault are of one session.", of_one_session, timed=True
    ),
)
