"""Section 4: the counter, SAMPLE, HEALTH and answers."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.lines import SlcanLine
from dcmp_hil.wire.messages import (
    Edge,
    Health,
    Parameter,
    ParameterGet,
    ParameterResult,
    ParameterValue,
    State,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client
    from dcmp_hil.conformance.listener import Seen

_SILENCE_S = 0.4
_CLOCK_RATIO_MIN = 0.5  # of the device's clock by this computer's: far beyond any crystal
_CLOCK_RATIO_MAX = 2.0  # the same, upper bound
_REQUESTS_AT_ONCE = 16
_IDLE_PERCENT = 100


def counter(client: Client) -> Iterator[str]:
    """Listen to 300 SAMPLEs; what the device says it could not send is no gap of the counter."""
    before = client.health()
    client.drain()
    seen = client.listen(300)
    after = client.health()
    damaged = client.line.damaged
    gaps = [(old.tick, new.tick) for old, new in pairwise(seen) if new.tick != old.tick + 1]
    excused = after.ring_overruns - before.ring_overruns
    if gaps and not excused and not damaged:
        old, new = gaps[0]
        yield f"SAMPLE {old & 255} is followed by SAMPLE {new & 255}; one SAMPLE a period, counted by one"
    yield from _idle(seen)


def _idle(seen: list[Seen]) -> Iterator[str]:
    """Judge SAMPLEs of a device in IDLE that no host drives."""
    for what, wrong in (
        ("is not in IDLE", [one for one in seen if one.sample.state != State.IDLE]),
        ("says a voltage other than 0 in IDLE", [one for one in seen if one.sample.voltage_mV]),
        ("says missed = 0 though no DRIVE was sent", [one for one in seen if not one.sample.missed]),
        ("says limited in IDLE", [one for one in seen if one.sample.limited]),
        ("says a fault_class other than 0 in IDLE", [one for one in seen if one.sample.fault_class]),
    ):
        if wrong:
            yield f"SAMPLE {wrong[0].tick & 255} {what}"


def tick_parameter(client: Client) -> Iterator[str]:
    """Read TICK over and over; it goes on as SAMPLE's does."""
    first = client.value(Parameter.TICK)
    at = client.tick
    for _ in range(12):
        client.listen(23)
        before = client.tick
        value = client.value(Parameter.TICK)
        # taken after SAMPLE `before` was read, and about when the newest one was
        if not before - at <= (value - first) % 2**31 <= client.tick - at + 2:
            yield (
                f"TICK went on by {(value - first) % 2**31} while SAMPLE's tick went on by {client.tick - at}"
            )
            return
        if (value - client.samples[-1].sample.tick + 128) % 256 - 128 not in range(-3, 3):
            yield f"TICK is {value}, SAMPLE says {client.samples[-1].sample.tick} modulo 256"
            return


def counter_goes_on(client: Client) -> Iterator[str]:
    """Check that the tick also counts SAMPLEs that were not received."""
    line, clock = client.line, client.clock
    first = client.value(Parameter.TICK)
    began_ns = clock.now_ns()
    if isinstance(line, SlcanLine):
        line.write(b"C\r")
    clock.sleep_until_ns(began_ns + int(1e9 * _SILENCE_S))
    client.forget_lateness()
    if isinstance(line, SlcanLine):
        line.write(b"O\r")
    client.drain()
    client.listen(2)
    value = client.value(Parameter.TICK)
    passed_us = (clock.now_ns() - began_ns) / 1000
    periods = passed_us / client.period_us
    counted = (value - first) % 2**31
    if not _CLOCK_RATIO_MIN * periods <= counted <= _CLOCK_RATIO_MAX * periods:
        yield (
            f"{periods:.0f} periods of {client.period_us} us passed while nothing was read, TICK went on by "
            f"{counted}: it counts periods, whether their SAMPLE could be sent or not"
        )
    client.synchronise()  # more SAMPLEs than a byte counts may be missing
    low = (client.value(Parameter.TICK) - client.samples[-1].sample.tick + 128) % 256 - 128
    if low not in range(-3, 3):
        yield f"SAMPLE's tick and TICK differ by {low} after SAMPLEs that were not sent"


def health(client: Client) -> Iterator[str]:
    """Listen to HEALTH for a while."""
    ticks, found = _healths(client)
    if len(found) < 3:  # noqa: PLR2004 - two intervals
        yield f"{len(found)} HEALTHs in {6 * client.periods(100)} periods; one comes every 100 ms"
        return
    steps = {new - old for old, new in pairwise(ticks)}
    if not steps <= {client.periods(100) + late for late in (-1, 0, 1)}:
        yield f"HEALTH came after {sorted(steps)} periods; it comes every {client.periods(100)}"
    for old, new in pairwise(found):
        if any(new[i] < old[i] for i in range(5)):
            yield f"a counter of HEALTH fell: {old} then {new}"
    if any(one.idle_percent > _IDLE_PERCENT for one in found):
        yield f"idle_percent is {max(one.idle_percent for one in found)}"


def _healths(client: Client) -> tuple[list[int], list[Health]]:
    """Listen for 600 ms; return the tick of the SAMPLE before each HEALTH, and each HEALTH."""
    client.drain()
    at, ticks = len(client.heard), []
    found: list[Health] = []
    for _ in range(6 * client.periods(100)):
        client.listen()
        for message in client.heard[at:]:
            if isinstance(message, Health):
                ticks.append(client.tick)
                found.append(message)
        at = len(client.heard)
    return ticks, found


def answers(client: Client) -> Iterator[str]:
    """Ask sixteen questions at once."""
    client.drain()
    at = len(client.heard)
    for _ in range(_REQUESTS_AT_ONCE):
        client.send(ParameterGet(Parameter.PERIOD_US))
    client.settled_state()
    came = sum(
        isinstance(message, ParameterValue) and message.id == Parameter.PERIOD_US
        for message in client.heard[at:]
    )
    if came != _REQUESTS_AT_ONCE:
        yield f"{_REQUESTS_AT_ONCE} questions sent at once were answered {came} times"


def edges(client: Client) -> Iterator[str]:
    """Listen without asking for EDGE; then ask, which a board without stamps refuses."""
    client.drain()
    at = len(client.heard)
    client.listen(client.periods(100))
    if any(isinstance(message, Edge) for message in client.heard[at:]):
        yield "EDGE comes though EDGE_STAMPS is 0"
    session = client.own()
    answer = client.put(session, Parameter.EDGE_STAMPS, 1)
    if answer is None:
        yield "PARAMETER_SET EDGE_STAMPS is not answered"
    elif (answer.value, answer.result) not in ((1, ParameterResult.OK), (0, ParameterResult.OUT_OF_RANGE)):
        yield f"EDGE_STAMPS set to 1 was answered by value {answer.value}, result {answer.result}"


CHECKS = (
    DeviceCheck(
        "sample-counter",
        "4",
        "One SAMPLE a period, its tick counted by one; in IDLE it says 0 V, missed, no fault.",
        counter,
    ),
    DeviceCheck(
        "tick-parameter", "4", "TICK is the counter of SAMPLE, modulo 2^31.", tick_parameter, timed=True
    ),
    DeviceCheck(
        "counter-goes-on",
        "4",
        "tick counts periods, whether their SAMPLE could be sent or not.",
        counter_goes_on,
        timed=True,
    ),
    DeviceCheck("health", "4", "HEALTH comes every 100 ms, its counters never fall.", health),
    DeviceCheck("answers", "4", "Sixteen answers wait behind the reports.", answers),
    DeviceCheck("edge-stamps", "4", "EDGE comes only if EDGE_STAMPS asks for it.", edges),
)
