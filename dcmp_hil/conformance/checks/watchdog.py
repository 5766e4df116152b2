"""Section 8 with --arm: a host that falls silent in RUN."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.checks.arming import LOW_VOLTAGE_MV, run
from dcmp_hil.conformance.checks.running import lower
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Hello, Parameter, State
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client
    from dcmp_hil.conformance.listener import Seen


def _bound(client: Client, accepted: int, fault: Seen | None, watchdog_ms: int, what: str) -> Iterator[str]:
    """Judge the first SAMPLE that says FAULT: the last DRIVE came in the period that ended at `accepted`."""
    if fault is None:
        yield f"{what}: no FAULT; the device goes on without a host"
        return
    earliest = accepted - 1 + int(1000 * watchdog_ms / client.period_us)
    latest = accepted + client.periods(watchdog_ms) + 1
    if not earliest <= fault.tick <= latest:
        yield (
            f"{what}: FAULT came {fault.tick - accepted} periods after the tick that took the last DRIVE, "
            f"between {earliest - accepted} and {latest - accepted} are right"
        )
    later = [seen for seen in client.samples if seen.tick > fault.tick]
    if any(seen.sample.voltage_mV for seen in later):
        yield f"{what}: a SAMPLE after the first one in FAULT says {later[0].sample.voltage_mV} mV, not 0"
    if fault.sample.fault_class != Fault.HOST_SILENT:
        yield f"{what}: SAMPLE says fault_class {fault.sample.fault_class}, the page 1"
    report = fault.fault
    if report is None:
        yield f"{what}: no FAULT came before the first SAMPLE that says so"
    elif not 1000 * watchdog_ms < report.detail <= 1000 * watchdog_ms + client.period_us:
        yield (
            f"{what}: FAULT's detail is {report.detail} us, the age of the last DRIVE is above "
            f"{1000 * watchdog_ms} and at most a period more"
        )


def _last_accepted(client: Client, mark: int) -> int:
    ticks = [seen.tick for seen in client.samples[mark:] if not seen.sample.missed]
    if not ticks:
        raise NotJudgedError("no DRIVE was accepted in RUN")
    return ticks[-1]


def watchdog(client: Client) -> Iterator[str]:
    """Fall silent in RUN, with the watchdog as built, set, and shortened by ttl_ms."""
    built = client.value(Parameter.WATCHDOG_MS)
    for what, set_ms, ttl_ms in (
        (f"WATCHDOG_MS {built}", 0, 50),
        (f"WATCHDOG_MS {min(10, built)}", min(10, built), 50),
        (f"WATCHDOG_MS {built}, ttl_ms {min(7, built)}", 0, min(7, built)),
    ):
        session = client.own()
        if set_ms:
            lower(client, session, Parameter.WATCHDOG_MS, set_ms)
        run(client, session)
        client.newest()
        mark = client.mark()
        client.drive(session, LOW_VOLTAGE_MV, arm=True, ttl_ms=ttl_ms)
        bound = min(set_ms or built, ttl_ms)
        fault = client.wait_for(State.FAULT, client.periods(2 * bound + 30))
        client.listen(2)
        yield from _bound(client, _last_accepted(client, mark), fault, bound, what)
        _cleared(client, session)


def _cleared(client: Client, session: int) -> None:
    """Clear the fault that a check made, and give the device back."""
    for clear in (False, True) * 5:
        client.newest()
        if client.state != State.FAULT:
            break
        client.drive(session, clear=clear)
    client.listen(2)
    client.newest()
    client.drive(session, release=True)
    client.listen(3)


def fed_by_nothing_else(client: Client) -> Iterator[str]:
    """Send everything but an accepted DRIVE: the watchdog hears none of it."""
    session = client.own()
    bound = client.value(Parameter.WATCHDOG_MS)
    run(client, session)
    client.newest()
    mark = client.mark()
    client.drive(session, LOW_VOLTAGE_MV, arm=True)
    at, other = client.tick, client.another_session()
    fault = None
    for _ in range(client.periods(2 * bound + 30)):
        client.newest()
        if client.state == State.FAULT:
            fault = next(seen for seen in client.samples[mark:] if seen.sample.state == State.FAULT)
            break
        client.drive(session, LOW_VOLTAGE_MV, arm=True, back=client.tick - at)  # the same seq again
        client.drive(session, LOW_VOLTAGE_MV, arm=True, back=client.reach + 10)
        client.drive(other, LOW_VOLTAGE_MV, arm=True)
        client.drive(session, LOW_VOLTAGE_MV, arm=True, ttl_ms=51)
        client.send(Hello(session, PROTOCOL_HASH))
    client.listen(2)
    yield from _bound(
        client, _last_accepted(client, mark), fault, bound, "refused DRIVEs and HELLOs feed nothing"
    )


CHECKS = (
    DeviceCheck(
        "watchdog",
        "8",
        "0 V comes after the watchdog's time, or ttl_ms, and at most one tick.",
        watchdog,
        needs_arm=True,
    ),
    DeviceCheck(
        "watchdog-fed",
        "6",
        "Nothing but an accepted DRIVE feeds the watchdog.",
        fed_by_nothing_else,
        needs_arm=True,
    ),
)
