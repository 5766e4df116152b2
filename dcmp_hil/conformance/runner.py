"""Runs checks one after the other, and leaves the device disarmed at 0 V however they end."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import Outcome, Verdict
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.device.node_uniqueness import NodeUniqueness
from dcmp_hil.errors import BackendError, OpenError, SampleTimeoutError
from dcmp_hil.wire.messages import State

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from dcmp_hil.conformance.check import DeviceCheck
    from dcmp_hil.conformance.client import Client

_ATTEMPTS_MAX = 5  # of a check during which this host was late
_RELEASE_DRIVES = 5  # DRIVEs that ask for IDLE before STOP does
_PAUSE_S = 0.02
_IDENTIFICATION_SAMPLES = 40  # SAMPLEs at the start: whether they are of one device
_ARMED_STATES = (State.ARMING, State.RUN)


def run_checks(
    client: Client, checks: Sequence[DeviceCheck], *, armed: bool, clear: bool
) -> Iterator[Outcome]:
    """Run checks in order and yield the outcome of each.

    Parameters
    ----------
    client
        Its line is open.
    checks
        In this order.
    armed
        Whether the motor may move.
    clear
        Whether a fault that is latched at the start may be cleared.

    Raises
    ------
    OpenError
        If there is no device, a host has it, or it is in a fault that may not be cleared.
    LinkError
        If the line breaks.
    StoppedError
        If the end was asked for.
    """
    try:
        _begin(client, clear=clear)
        gone = ""
        for check in checks:
            if client.line.carrier not in check.carriers:
                yield Outcome(check, Verdict.OTHER_CARRIER)
            elif check.needs_arm and not armed:
                yield Outcome(check, Verdict.NEEDS_ARM)
            elif gone:
                yield Outcome(check, Verdict.NOT_JUDGED, (gone,))
            else:
                outcome = _run(client, check)
                gone = _settle(client)
                if gone:
                    outcome = Outcome(check, Verdict.FAILED, (*outcome.findings, gone))
                yield outcome
    finally:
        leave(client)


def _begin(client: Client, *, clear: bool) -> None:
    try:
        client.synchronise()
        uniqueness = NodeUniqueness()
        for seen in client.listen(_IDENTIFICATION_SAMPLES):
            uniqueness.add(seen.sample)
    except SampleTimeoutError as error:
        raise OpenError(str(error)) from error
    if uniqueness.two_devices:
        raise OpenError(
            f"{client.line.name}: two devices send as node {client.node}: their ticks jump forth and back. "
            "Unplug one."
        )
    identity = client.hello()
    if identity is not None and identity.busy:
        raise OpenError(f"{client.line.name}: in use by another host. End that first.")
    if client.state == State.FAULT:
        if not clear:
            raise OpenError(
                f"{client.line.name}: the device is in FAULT. Find out why (`dcmp-hil ports` names it), then "
                "add --clear."
            )
        _clear(client)


def _run(client: Client, check: DeviceCheck) -> Outcome:
    """Run a check; again, if this host was late and that may be the cause of what was found."""
    outcome, late = _try(client, check)
    for _ in range(_ATTEMPTS_MAX - 1):
        if not late or _settle(client):
            return outcome
        outcome, late = _try(client, check)
    if not late:
        return outcome
    why = (
        f"in each of {_ATTEMPTS_MAX} tries this computer or its port was too late to answer; in the last one:"
    )
    return Outcome(check, Verdict.NOT_JUDGED, (why, *outcome.findings))


def _try(client: Client, check: DeviceCheck) -> tuple[Outcome, bool]:
    stalls = client.stalls
    outcome = _run_once(client, check)
    timed = check.timed or check.needs_arm
    return outcome, timed and outcome.verdict != Verdict.PASSED and client.stalls > stalls


def _run_once(client: Client, check: DeviceCheck) -> Outcome:
    findings: list[str] = []
    try:
        findings.extend(check.run(client))
    except NotJudgedError as error:
        if not findings:  # what was found before stays found
            return Outcome(check, Verdict.NOT_JUDGED, (str(error),))
    except SampleTimeoutError as error:
        findings.append(str(error))
    return Outcome(check, Verdict.FAILED if findings else Verdict.PASSED, tuple(findings))


def _settle(client: Client) -> str:
    """Bring the device to IDLE, without an owner; return what stood against it."""
    try:
        for _ in range(3):
            leave(client)
            client.listen(3)
            if client.state == State.FAULT:
                _clear(client)
            identity = client.hello()
            if client.state == State.IDLE and (identity is None or not identity.busy):
                client.sessions.clear()
                return ""
            client.listen(client.periods(600))  # an ownership that is not renewed is over by then
    except SampleTimeoutError as error:
        return str(error)
    state = State(client.state).name if client.state in set(State) else f"state {client.state}"
    return f"afterwards the device could not be brought back to IDLE without an owner: it is in {state}"


def _clear(client: Client) -> None:
    """Clear a fault, as section 10 does: 0, 1, 0, 1 ..., each answering a SAMPLE, while it lasts."""
    with contextlib.suppress(NotJudgedError):
        session = client.own()
        for clear in (False, True) * 5:
            if client.newest().sample.state != State.FAULT:
                break
            client.drive(session, clear=clear)
        client.listen(2)
        client.drive(session, release=True)
        client.listen(2)


def leave(client: Client) -> None:
    """Disarm and give the device back, as far as the line still goes; its watchdog does the rest."""
    client.leaving = True
    try:
        for _ in range(_RELEASE_DRIVES):
            _hear_a_little(client)
            for session in client.sessions:
                client.drive(session, release=True)
            _hear_a_little(client)
            if not client.samples or client.state not in _ARMED_STATES:
                return
        client.stop()
    except BackendError:
        return  # the port is gone: silence is what the watchdog hears
    finally:
        client.leaving = False


def _hear_a_little(client: Client) -> None:
    """Read the waiting messages, and up to three more; a device may be silent."""
    client.drain()
    for _ in range(3):
        client.take(_PAUSE_S)
