"""Section 6: which DRIVE is accepted; SAMPLE's `missed` says it, without a motor that moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.wire.messages import Drive, State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.conformance.client import Client

COUNTER_START_MAX = 200  # a counter of HEALTH below this has room for what is sent here
_ATTEMPTS_MAX = 40


def was_accepted(client: Client, send: Callable[[], None]) -> bool:
    """Send by `send` after a fresh SAMPLE; return whether the device accepted a DRIVE."""
    client.newest()
    mark = client.mark()
    send()
    return any(not seen.sample.missed for seen in client.after_fence(mark))


def accepted(client: Client) -> Iterator[str]:
    """Answer SAMPLEs; the device takes the answers, and says missed in the other periods."""
    session = client.own()
    if not any(was_accepted(client, lambda: client.drive(session)) for _ in range(_ATTEMPTS_MAX)):
        yield f"none of {_ATTEMPTS_MAX} DRIVEs, each answering the newest SAMPLE, was accepted"
        return
    client.settled_state()
    if any(not seen.sample.missed for seen in client.listen(20)):
        yield "SAMPLE says missed = 0 in periods without a DRIVE"
    if client.state != State.IDLE:
        yield "a DRIVE with arm = 0 leads out of IDLE"


def refused(client: Client) -> Iterator[str]:
    """Send DRIVEs against rules 1 and 2: they feed nothing and count as nothing."""
    session = client.own()
    other = client.another_session()
    before = client.health().sequence_gaps

    def raw(*, clear: bool = False, release: bool = False, of: int = session, ttl_ms: int = 50) -> None:
        client.send(Drive(0, client.tick % 8192, False, clear, release, of, ttl_ms))

    for what, send in (
        ("of another session", lambda: raw(of=other)),
        ("of session 0", lambda: raw(of=0)),
        ("with ttl_ms 4", lambda: raw(ttl_ms=4)),
        ("with ttl_ms 0", lambda: raw(ttl_ms=0)),
        ("with ttl_ms 51", lambda: raw(ttl_ms=51)),
        ("with ttl_ms 255", lambda: raw(ttl_ms=255)),
        ("with clear and release", lambda: raw(clear=True, release=True)),
    ):
        if was_accepted(client, send):
            yield f"a DRIVE {what} was accepted"
    grown = client.health().sequence_gaps - before
    if before < COUNTER_START_MAX and grown:
        yield f"DRIVEs that break rule 1 or 2 count as nothing, but sequence_gaps grew by {grown}"


def age(client: Client) -> Iterator[str]:
    """Answer old SAMPLEs, and ones that are still to come."""
    session = client.own()
    before = client.health().sequence_gaps
    backs = (client.reach + 1, client.reach + 2, client.reach + 40, 255, 256, 4096, -300)
    for back in backs:
        if was_accepted(client, lambda back=back: client.drive(session, back=back)):  # type: ignore[misc]
            what = f"{back} periods old" if back > 0 else f"{-back} periods ahead"
            yield f"a DRIVE was accepted whose SAMPLE is {what}; at most {client.reach} may pass"
    grown = client.health().sequence_gaps - before
    if before < COUNTER_START_MAX and grown != len(backs):
        yield f"{len(backs)} DRIVEs were too old or ahead, sequence_gaps grew by {grown}"


def oldest(client: Client) -> Iterator[str]:
    """Answer the oldest SAMPLE that may be answered, where the line is quick enough."""
    session = client.own()
    quick = 0
    for _ in range(_ATTEMPTS_MAX):
        client.newest()
        at, mark = client.tick, client.mark()
        client.drive(session)
        first = next((s for s in client.after_fence(mark) if not s.sample.missed), None)
        quick += first is not None and first.tick == at + 1
        client.listen(client.reach + 1)  # or it would be older than the one before
        if was_accepted(client, lambda: client.drive(session, back=client.reach)):
            return
    if quick < _ATTEMPTS_MAX // 2:
        raise NotJudgedError("the way to the device takes more than a period")
    yield f"no DRIVE was accepted whose SAMPLE was {client.reach} periods old; so many may pass"


def order(client: Client) -> Iterator[str]:
    """Send the same DRIVE again, and one that is older: a command is taken once, and never turns back."""
    session = client.own()
    before = client.health().sequence_gaps
    for _ in range(_ATTEMPTS_MAX):
        mark = client.mark()
        client.newest()
        at = client.tick
        client.drive(session)
        since = client.after_fence(mark)
        if any(not seen.sample.missed and seen.tick <= at + 2 for seen in since):
            break
    else:
        raise NotJudgedError("no DRIVE was accepted: `drive-accepted` says more")
    mark = client.mark()
    back = client.tick - at
    client.drive(session, back=back)
    client.drive(session, back=back + 1)
    if any(not seen.sample.missed for seen in client.after_fence(mark)):
        yield "a DRIVE whose seq is not newer than the last accepted one was accepted"
    client.newest()
    client.drive(session)
    client.drive(session)
    client.drive(session, back=1)
    client.after_fence(client.mark())
    grown = client.health().sequence_gaps - before
    if before < COUNTER_START_MAX and grown < 4:  # noqa: PLR2004 - four were sent
        yield f"four DRIVEs came twice or too late, sequence_gaps grew by {grown}"


CHECKS = (
    DeviceCheck(
        "drive-accepted",
        "6",
        "A DRIVE of the owner that answers the newest SAMPLE is accepted; SAMPLE's missed says so.",
        accepted,
        timed=True,
    ),
    DeviceCheck(
        "drive-refused",
        "6",
        "A DRIVE of another session, with a ttl_ms outside 5..50 or two flags feeds nothing.",
        refused,
    ),
    DeviceCheck(
        "drive-age",
        "6",
        "A DRIVE that answers a SAMPLE older than 3 ms, or one to come, is refused and counted.",
        age,
        timed=True,
    ),
    DeviceCheck(
        "drive-oldest", "6", "A DRIVE that answers a SAMPLE of 3 ms ago is accepted.", oldest, timed=True
    ),
    DeviceCheck(
        "drive-order", "6", "A DRIVE is newer than the last accepted one, or is refused.", order, timed=True
    ),
)
