"""Section 5: who owns the device."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.wire.messages import Hello, Identity, Parameter, ParameterResult
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from dcmp_hil.conformance.client import Client

_LEASE_MS = 500
_LEASE_END_MARGIN_MS = 60  # a question at that distance of the end is safe on a slow line


def _said(client: Client, session: int, expected: str, when: str, wrong: int = 0) -> Iterator[str]:
    """Compare IDENTITY's flags: letters of busy, owned, mismatch."""
    identity = client.hello(session, wrong)
    if identity is None:
        yield f"{when}: HELLO is not answered"
        return
    flags = "".join(
        letter for letter, on in (("b", identity.busy), ("o", identity.owned), ("m", identity.mismatch)) if on
    )
    if flags != expected:
        yield f"{when}: IDENTITY says {_words(flags)}, the page {_words(expected)}"


def _words(flags: str) -> str:
    names = {"b": "busy", "o": "owned", "m": "mismatch"}
    return " + ".join(names[letter] for letter in flags) or "neither busy, owned nor mismatch"


def identity(client: Client) -> Iterator[str]:
    """Ask who is there, with the right hash and a wrong one."""
    found = client.hello()
    if found is None:
        yield "HELLO with session 0 is not answered by IDENTITY"
        return
    if found.protocol_hash != PROTOCOL_HASH:
        yield (
            f"the device's protocol hash is {found.protocol_hash:08x}, this page's {PROTOCOL_HASH:08x}: it "
            "was built from another dcmp.dbc"
        )
    yield from _said(client, 0, "", "HELLO with session 0")
    yield from _said(client, 0, "m", "HELLO with session 0 and another hash", wrong=1)
    yield from _said(client, client.another_session(), "m", "HELLO with another hash", wrong=1 << 31)
    yield from _said(client, 0, "", "HELLO with session 0 after one with another hash")


def ownership(client: Client) -> Iterator[str]:
    """Own the device, and be refused as a second host."""
    session, other = client.another_session(), 0
    yield from _said(client, session, "o", "the first HELLO with a session")
    other = client.another_session()
    yield from _said(client, other, "b", "HELLO of a second host")
    yield from _said(client, 0, "b", "HELLO with session 0 while it is owned")
    yield from _said(client, session, "o", "HELLO of the owner")
    yield from _said(client, session, "om", "HELLO of the owner with another hash", wrong=1)
    mark = client.mark()
    client.drive(other)
    if any(not seen.sample.missed for seen in client.after_fence(mark)):
        yield "a DRIVE of a session that does not own the device was accepted"


def repeated_hello(client: Client) -> Iterator[str]:
    """HELLO of the owner again: nothing begins anew."""
    session = client.own()
    built = client.value(Parameter.VOLTAGE_LIMIT_MV)
    answer = client.put(session, Parameter.VOLTAGE_LIMIT_MV, 1)
    if answer is None or answer.result != ParameterResult.OK:
        raise NotJudgedError("VOLTAGE_LIMIT_MV could not be lowered: `parameters-range` says more")
    _accepted(client, session)
    before = client.health().sequence_gaps
    yield from _said(client, session, "o", "HELLO of the owner")
    if (now := client.value(Parameter.VOLTAGE_LIMIT_MV)) != 1:
        yield (
            f"VOLTAGE_LIMIT_MV was set to 1 of {built} and is {now} after the owner's second HELLO: that is "
            "no new ownership"
        )
    mark = client.mark()
    client.newest()
    client.drive(session)
    client.drive(session)  # the same seq: refused by its order
    client.send(Hello(session, PROTOCOL_HASH))
    client.drive(session)  # and still, after another HELLO
    client.after_fence(mark)
    grown = client.health().sequence_gaps - before
    if before < _COUNTER_START_MAX and grown < 2:  # noqa: PLR2004 - two were sent
        yield "a DRIVE with the seq of the one before was accepted after the owner's second HELLO"


_SETTABLE = (
    *(Parameter.VOLTAGE_LIMIT_MV, Parameter.SLEW_MV_PER_MS, Parameter.WATCHDOG_MS),
    *(Parameter.SPEED_LIMIT_COUNTS_S, Parameter.TRAVEL_LIMIT_COUNTS, Parameter.EDGE_STAMPS),
    Parameter.TRAVEL_ORIGIN_COUNTS,
)
_COUNTER_START_MAX = 240  # a counter of HEALTH below this has room


def _accepted(client: Client, session: int) -> None:
    """Send a DRIVE that is accepted, so that the next one has a predecessor."""
    for _ in range(50):
        client.newest()
        mark = client.mark()
        client.drive(session)
        if any(not seen.sample.missed for seen in client.after_fence(mark)):
            return
    raise NotJudgedError("no DRIVE was accepted: `drive-accepted` says more")


def two_hellos(client: Client) -> Iterator[str]:
    """Send HELLO twice at once, as a host does that repeats it: both are answered, both say owned."""
    session = client.another_session()
    client.sessions.append(session)
    client.drain()
    at = len(client.heard)
    client.send(Hello(session, PROTOCOL_HASH))
    client.send(Hello(session, PROTOCOL_HASH))
    client.settled_state()
    found = [message for message in client.heard[at:] if isinstance(message, Identity)]
    if len(found) != 2:  # noqa: PLR2004 - two were sent
        yield f"two HELLOs sent at once were answered {len(found)} times"
    elif not all(one.owned and not one.busy for one in found):
        yield "of two HELLOs of one session, sent at once, not both were answered by owned"


def release(client: Client) -> Iterator[str]:
    """Release the device by a DRIVE."""
    session = client.own()
    for _ in range(20):
        client.newest()
        client.drive(session, release=True)
        client.listen(2)
        found = client.hello()
        if found is not None and not found.busy:
            break
    else:
        yield "a DRIVE with release = 1 does not end the ownership"
        return
    yield from _said(client, client.another_session(), "o", "HELLO of another host after a release")


def lease(client: Client) -> Iterator[str]:
    """Fall silent: what is not valid or of others renews nothing, and after 500 ms the device is free."""
    session = client.own()
    client.get(Parameter.TICK)
    asked = client.tick
    client.listen(client.periods(_LEASE_MS - _LEASE_END_MARGIN_MS))
    client.hello(session, 1)  # another hash, and
    answer = client.hello()  # session 0: both renew nothing
    if client.tick - asked < client.periods(_LEASE_MS) and answer is not None and not answer.busy:
        yield f"the ownership was over {client.tick - asked} periods after the owner's HELLO, before 500 ms"
    client.listen(client.periods(2 * _LEASE_END_MARGIN_MS))
    answer = client.hello()
    if answer is not None and answer.busy:
        yield (
            f"the ownership lasts {client.tick - asked} periods after the owner's last message; it ends "
            "after 500 ms"
        )
    session = client.own()
    for _ in range(3):  # a PARAMETER_SET counts, refused or not
        client.listen(client.periods(_LEASE_MS - 2 * _LEASE_END_MARGIN_MS))
        client.put(session, Parameter.TICK, 0)
    answer = client.hello()
    if answer is not None and not answer.busy:
        yield "a PARAMETER_SET of the owner does not renew its ownership"


def _changed(client: Client, built: Mapping[Parameter, int], when: str) -> Iterator[str]:
    for parameter, value in built.items():
        if (now := client.value(parameter)) != value:
            yield f"{parameter.name} is {now} {when}; it was built with {value}"


def as_built(client: Client) -> Iterator[str]:
    """Change every parameter, give the device back, own it again, as another host and as the same."""
    for again in (False, True):
        session = client.own()
        built = {parameter: client.value(parameter) for parameter in _SETTABLE}
        for parameter in _SETTABLE:
            other = 17 if built[parameter] != 17 else 16  # noqa: PLR2004 - any other will do
            client.put(session, parameter, 1 if parameter == Parameter.EDGE_STAMPS else other)
        for _ in range(20):
            client.newest()
            client.drive(session, release=True)
            client.listen(2)
            found = client.hello()
            if found is not None and not found.busy:
                break
        yield from _changed(client, built, "after the session that set it")
        client.hello(session if again else client.another_session())
        who = "the same session" if again else "another session"
        yield from _changed(client, built, f"when {who} is given the device")
        client.listen(client.periods(_LEASE_MS + 2 * _LEASE_END_MARGIN_MS))


CHECKS = (
    DeviceCheck("identity", "5", "HELLO is answered by IDENTITY, which says the hash.", identity),
    DeviceCheck("ownership", "5", "One session owns the device, a second host is refused.", ownership),
    DeviceCheck(
        "repeated-hello", "5", "A HELLO of the owner is no new ownership.", repeated_hello, timed=True
    ),
    DeviceCheck("two-hellos", "10", "A HELLO sent twice is answered twice, and owns once.", two_hellos),
    DeviceCheck("release", "5", "A DRIVE with release = 1 ends the ownership.", release, timed=True),
    DeviceCheck("lease", "5", "Ownership ends 500 ms after the owner's last message.", lease, timed=True),
    DeviceCheck("as-built", "9", "What a session changed ends with it.", as_built, timed=True),
)
