"""Section 7 with --arm: ten DRIVEs from IDLE to RUN, and every way back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.checks.drives import was_accepted
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.wire.messages import Parameter, ParameterResult, State

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client

_DRIVES_UNTIL_RUN = 10
LOW_VOLTAGE_MV = 300
"""mV, what most checks put out: enough to be seen in SAMPLE, too little to do harm."""


def to_run(client: Client) -> Iterator[str]:
    """Send nine DRIVEs, then ten."""
    session = client.own()
    for _ in range(2):  # the second time what was counted before counts no more
        if _after(client, session, _DRIVES_UNTIL_RUN - 1) == State.RUN:
            yield f"{_DRIVES_UNTIL_RUN - 1} DRIVEs lead from IDLE to RUN; ten are needed"
            return
        _disarm(client, session)
    for _ in range(10):  # one of ten may come too late
        first = client.mark()
        state = _after(client, session, _DRIVES_UNTIL_RUN)
        arming = [s.sample for s in client.samples[first:] if s.sample.state == State.ARMING]
        if any(sample.voltage_mV for sample in arming):
            yield "SAMPLE says a voltage other than 0 in ARMING"
        if state == State.RUN:
            return
        _disarm(client, session)
    yield "ten DRIVEs with arm = 1 at 0 V, each answering a SAMPLE, do not lead to RUN"


def _after(client: Client, session: int, drives: int) -> int:
    """Answer so many SAMPLEs, none of them twice; return the state that follows."""
    for _ in range(drives):
        client.newest()
        client.drive(session, arm=True)
    client.after_fence(client.mark())
    return client.state


def _disarm(client: Client, session: int) -> None:
    for _ in range(20):
        client.newest()
        if client.state == State.IDLE:
            return
        client.drive(session)
    raise NotJudgedError("a DRIVE with arm = 0 does not lead to IDLE: `disarm` says more")


def _begin_arming(client: Client, session: int, drives: int = 4) -> bool:
    """Bring the device to ARMING; return whether it is there."""
    for _ in range(40):
        client.newest()
        if client.state == State.ARMING and drives <= 0:
            return True
        client.drive(session, arm=True)
        drives -= 1
        if client.state in (State.RUN, State.FAULT):
            return False
    return False


def broken(client: Client) -> Iterator[str]:
    """Break the arming sequence in each way."""
    session = client.own()
    for what, word in (
        ("arm = 0", {"arm": False}),
        ("clear = 1", {"clear": True}),
        ("a voltage other than 0", {"arm": True, "voltage_mV": 1}),
    ):
        if not _begin_arming(client, session):
            raise NotJudgedError("the device does not stay in ARMING: `arming` says more")
        client.drive(session, **word)
        if client.settled_state() != State.IDLE:
            yield f"a DRIVE with {what} does not lead from ARMING to IDLE"
        _disarm(client, session)
    if not _begin_arming(client, session):
        raise NotJudgedError("the device does not stay in ARMING: `arming` says more")
    client.listen(client.reach + 2)
    client.newest()
    client.drive(session, arm=True)
    if client.settled_state() != State.IDLE:
        yield f"arming goes on though {client.reach + 2} SAMPLEs were not answered"
    _disarm(client, session)
    client.newest()
    client.drive(session, 1, arm=True)
    if client.settled_state() != State.IDLE:
        yield "a DRIVE with arm = 1 and a voltage other than 0 leads out of IDLE"


def flags(client: Client) -> Iterator[str]:
    """Send DRIVEs with `arm` and another flag: they contradict themselves."""
    session = client.own()
    for what, word in (
        ("arm and clear", {"clear": True}),
        ("arm and release", {"release": True}),
        ("all three flags", {"clear": True, "release": True}),
    ):
        if was_accepted(client, lambda word=word: client.drive(session, arm=True, **word)):  # type: ignore[misc]
            yield f"a DRIVE with {what} was accepted; at most one flag may be 1"


def silent(client: Client) -> Iterator[str]:
    """Fall silent in ARMING."""
    session = client.own()
    if not _begin_arming(client, session):
        raise NotJudgedError("the device does not stay in ARMING: `arming` says more")
    watchdog = client.value(Parameter.WATCHDOG_MS)
    first = client.mark()
    client.listen(client.periods(watchdog) + client.reach + 5)
    if client.state != State.IDLE:
        yield f"{watchdog} ms without a DRIVE do not lead from ARMING to IDLE"
    if any(seen.sample.state == State.FAULT for seen in client.samples[first:]):
        yield "silence in ARMING leads to FAULT; it leads to IDLE"


def run(client: Client, session: int, voltage_mV: int = LOW_VOLTAGE_MV, ticks: int = 15) -> None:
    """Arm, and put a voltage out for a while.

    Raises
    ------
    NotJudgedError
        If the device leaves RUN meanwhile.
    """
    client.arm(session)
    client.answer(ticks, session, voltage_mV)
    if client.state != State.RUN:
        raise NotJudgedError("the device left RUN while each SAMPLE was answered")


def disarm(client: Client) -> Iterator[str]:
    """Disarm while a voltage is put out."""
    session = client.own()
    for what, word in (
        ("arm = 0", {"arm": False}),
        ("clear = 1", {"clear": True}),
        ("release = 1", {"release": True}),
    ):
        run(client, session)
        client.newest()
        mark = client.mark()
        client.drive(session, LOW_VOLTAGE_MV, **word)
        since = client.after_fence(mark)
        if client.state != State.IDLE:
            yield f"a DRIVE with {what} does not lead from RUN to IDLE"
        if any(seen.sample.state == State.IDLE and seen.sample.voltage_mV for seen in since):
            yield f"after a DRIVE with {what} SAMPLE says IDLE and a voltage; 0 V come at once"
    found = client.hello()
    if found is not None and found.busy:
        yield "a DRIVE with release = 1 in RUN does not end the ownership"


def stopped_in_run(client: Client) -> Iterator[str]:
    """Send STOP while a voltage is put out; then go on driving: it stays off."""
    session = client.own()
    run(client, session)
    mark = client.mark()
    client.stop(3)
    since = client.after_fence(mark)
    if client.state != State.FAULT:
        yield "STOP does not lead from RUN to FAULT"
        return
    if any(seen.sample.state == State.FAULT and seen.sample.voltage_mV for seen in since):
        yield "after STOP SAMPLE says FAULT and a voltage; 0 V come at once"
    later = client.answer(20, session)
    if any(seen.sample.state != State.FAULT for seen in later):
        yield "DRIVEs with arm = 1 lead out of FAULT"


def second_host(client: Client) -> Iterator[str]:
    """Check that a second host is refused while the first drives."""
    session = client.own()
    run(client, session)
    other = client.another_session()
    client.newest()
    client.drive(session, LOW_VOLTAGE_MV, arm=True)
    found = client.hello(other)
    client.newest()
    client.drive(session, LOW_VOLTAGE_MV, arm=True)
    if found is not None and (found.owned or not found.busy):
        yield "a HELLO of a second host in RUN is not answered by busy"
    for _ in range(8):
        client.newest()
        client.drive(session, LOW_VOLTAGE_MV, arm=True)
        client.drive(other, -LOW_VOLTAGE_MV, arm=True)
    seen = client.answer(3, session, LOW_VOLTAGE_MV)
    if any(one.sample.voltage_mV < 0 for one in seen):
        yield "a DRIVE of a session that does not own the device was applied"


def not_idle(client: Client) -> Iterator[str]:
    """Try to change a limit in RUN."""
    session = client.own()
    client.arm(session)
    client.newest()
    client.drive(session, arm=True)
    found = client.put(session, Parameter.VOLTAGE_LIMIT_MV, 1)
    if found is None:
        yield "PARAMETER_SET is not answered in RUN"
    elif found.result != ParameterResult.NOT_IDLE or found.value == 1:
        yield f"PARAMETER_SET in RUN is answered by result {found.result}, value {found.value}, not by 4"


CHECKS = (
    DeviceCheck("arming", "7", "Ten DRIVEs at 0 V lead from IDLE to RUN.", to_run, needs_arm=True),
    DeviceCheck("arming-broken", "7", "A broken arming sequence leads to IDLE.", broken, needs_arm=True),
    DeviceCheck(
        "arming-flags", "6", "A DRIVE with arm and another flag feeds nothing.", flags, needs_arm=True
    ),
    DeviceCheck("arming-silent", "8", "Silence in ARMING leads to IDLE.", silent, needs_arm=True),
    DeviceCheck(
        "disarm", "7", "arm = 0, clear = 1 and release = 1 end RUN at 0 V at once.", disarm, needs_arm=True
    ),
    DeviceCheck(
        "stop-in-run",
        "7",
        "STOP in RUN leads to FAULT at 0 V at once, and nothing leads from FAULT to RUN.",
        stopped_in_run,
        needs_arm=True,
    ),
    DeviceCheck("second-host", "5", "A second host changes nothing in RUN.", second_host, needs_arm=True),
    DeviceCheck("parameters-in-run", "9", "PARAMETER_SET is refused in RUN.", not_idle, needs_arm=True),
)
