"""Sections 4, 6, 7 and 8 with --arm: voltages and limits."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.conformance.checks.arming import LOW_VOLTAGE_MV, run
from dcmp_hil.conformance.checks.drives import COUNTER_START_MAX
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import FaultReport, Parameter, ParameterResult, State

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client

PUSH_VOLTAGE_MV = 1000
"""mV, for 300 ms at most: `travel-limit` and `speed-limit` alone wait for the arm to move."""
_CORRUPT_FRAMES_LIMIT = 10


def lower(client: Client, session: int, parameter: Parameter, value: int) -> None:
    """Set a parameter for a check."""
    found = client.put(session, parameter, value)
    if found is None or found.result != ParameterResult.OK:
        raise NotJudgedError(f"{parameter.name} could not be set to {value}: `parameters-range` says more")


def _no_slew(client: Client) -> None:
    if client.value(Parameter.SLEW_MV_PER_MS):
        raise NotJudgedError("the board has a slew limit; `slew` judges it")


def voltage(client: Client) -> Iterator[str]:
    """Step between two voltages; SAMPLE says each one tick after the one in which it was accepted."""
    _no_slew(client)
    session = client.own()
    run(client, session)
    for wanted in (LOW_VOLTAGE_MV, -LOW_VOLTAGE_MV, 0, LOW_VOLTAGE_MV // 2):
        before = client.answer(6, session, wanted)[-1].sample.voltage_mV
        if before != wanted:
            yield f"a DRIVE of {wanted} mV is answered by {before} mV in SAMPLE"
    client.answer(6, session, 0)
    client.newest()
    mark = client.mark()
    client.drive(session, LOW_VOLTAGE_MV, arm=True)
    since = client.after_fence(mark)
    client.drive(session, LOW_VOLTAGE_MV, arm=True)
    accepted = next((seen.tick for seen in since if not seen.sample.missed), None)
    shown = next((seen.tick for seen in since if seen.sample.voltage_mV), None)
    if accepted is None:
        raise NotJudgedError("a DRIVE in RUN was not accepted")
    if shown != accepted + 1:
        yield (
            f"a DRIVE accepted before tick {accepted & 255} is seen in SAMPLE "
            f"{'never' if shown is None else shown & 255}; it is applied at that tick and seen one later"
        )


def held(client: Client) -> Iterator[str]:
    """Leave out some DRIVEs: the voltage stays, SAMPLE says missed, HEALTH counts each."""
    _no_slew(client)
    before = client.health().sequence_gaps
    session = client.own()
    run(client, session)
    mark = client.mark()
    client.listen(8)
    client.newest()
    client.drive(session, LOW_VOLTAGE_MV, arm=True)
    between = client.samples[mark + 2 : mark + 8]
    if client.state == State.FAULT:
        raise NotJudgedError("the watchdog was too quick: `watchdog` says more")
    if any(seen.sample.voltage_mV != LOW_VOLTAGE_MV for seen in between):
        yield "the voltage is not held in periods without a DRIVE"
    if not all(seen.sample.missed for seen in between):
        yield "SAMPLE says missed = 0 in RUN in periods without a DRIVE"
    client.drive(session)
    grown = client.health().sequence_gaps - before
    if before < COUNTER_START_MAX and grown < len(between):
        yield f"{len(between)} periods in RUN were missed, sequence_gaps grew by {grown}; each counts"


def clamp(client: Client) -> Iterator[str]:
    """Ask for more than the device's limit."""
    session = client.own()
    limit = LOW_VOLTAGE_MV // 2
    lower(client, session, Parameter.VOLTAGE_LIMIT_MV, limit)
    run(client, session, 0)
    for wanted in (LOW_VOLTAGE_MV, -LOW_VOLTAGE_MV):
        last = client.answer(20, session, wanted)[-1].sample
        bounded = limit if wanted > 0 else -limit
        if last.voltage_mV != bounded:
            yield f"a DRIVE of {wanted} mV under a limit of {limit} mV is answered by {last.voltage_mV} mV"
        if not last.limited:
            yield f"SAMPLE says limited = 0 for {wanted} mV under a limit of {limit} mV"
    if client.answer(20, session, limit)[-1].sample.limited:
        yield f"SAMPLE says limited = 1 for {limit} mV under a limit of {limit} mV"


def slew(client: Client) -> Iterator[str]:
    """Step under a slew limit of 20 mV/ms."""
    session = client.own()
    rate = 20
    lower(client, session, Parameter.SLEW_MV_PER_MS, rate)
    run(client, session, 0)
    seen = client.answer(client.periods(15) + 3, session, LOW_VOLTAGE_MV)
    step = rate * client.period_us / 1000
    rising = [one.sample.voltage_mV for one in seen if one.sample.voltage_mV]
    steps = [
        (new.sample.voltage_mV - old.sample.voltage_mV) / (new.tick - old.tick)
        for old, new in pairwise(seen)
        if old.sample.voltage_mV and new.sample.voltage_mV < LOW_VOLTAGE_MV and new.tick > old.tick
    ]
    if not rising or abs(rising[0]) > 2 * step + 1:
        yield f"under a slew limit of {rate} mV/ms the voltage began with {rising[0] if rising else 0} mV"
    elif any(abs(one - step) > 1.0 for one in steps):
        yield f"under a slew limit of {rate} mV/ms the voltage went by {steps[0]:g} mV a period"


def corrupt_link(client: Client) -> Iterator[str]:
    """Send nine corrupt frames, a hundred good ones, then ten."""
    session = client.own()
    run(client, session, ticks=client.periods(110))

    def spoil(times: int) -> None:
        for _ in range(times):
            client.newest()
            client.drive(session, arm=True, spoilt=True)
            client.drive(session, arm=True)

    spoil(_CORRUPT_FRAMES_LIMIT - 1)
    client.answer(3, session)
    if client.state != State.RUN:
        yield f"{_CORRUPT_FRAMES_LIMIT - 1} corrupt frames among 100 end RUN; ten do"
        return
    client.answer(client.periods(120), session)
    mark = client.mark()
    spoil(_CORRUPT_FRAMES_LIMIT + 2)
    client.listen(2)
    fault = next((seen for seen in client.samples[mark:] if seen.sample.state == State.FAULT), None)
    if fault is None:
        yield f"{_CORRUPT_FRAMES_LIMIT + 2} corrupt frames among 100 do not end RUN; ten do"
    elif fault.sample.fault_class != Fault.CORRUPT_LINK:
        yield f"corrupt frames in RUN lead to fault_class {fault.sample.fault_class}, the page says 4"
    elif fault.fault is not None and fault.fault.detail != _CORRUPT_FRAMES_LIMIT:
        yield f"FAULT(CORRUPT_LINK) says {fault.fault.detail} corrupt frames, not {_CORRUPT_FRAMES_LIMIT}"


def travel(client: Client) -> Iterator[str]:
    """Push the arm beyond a travel limit of one count."""
    session = client.own()
    lower(client, session, Parameter.TRAVEL_LIMIT_COUNTS, 1)
    client.drain()
    first, at = len(client.samples), len(client.heard)
    for _ in range(4 * client.periods(500)):
        client.newest()
        if client.state in (State.RUN, State.FAULT):
            break
        client.drive(session, arm=True)
    client.answer(client.periods(300), session, PUSH_VOLTAGE_MV)
    client.answer(2, session, 0)
    seen = client.samples[first:]
    moved = {one.sample.position_counts for one in seen if one.sample.state == State.RUN}
    report = next((one for one in client.heard[at:] if isinstance(one, FaultReport)), None)
    if report is None:
        if len(moved) <= 4:  # noqa: PLR2004 - the limit either way, and a count that trembles
            raise NotJudgedError(f"the arm does not move at {PUSH_VOLTAGE_MV} mV")
        yield f"the encoder moved through {len(moved)} counts beyond a travel limit of 1, without a fault"
    elif report.code != Fault.OVER_TRAVEL:
        yield f"a travel limit of 1 count led to fault {report.code}, the page says 6"
    elif abs(report.detail) < 2:  # noqa: PLR2004 - above 1
        yield f"FAULT(OVER_TRAVEL) says {report.detail} counts under a limit of 1"


CHECKS = (
    DeviceCheck(
        "voltage",
        "4",
        "A voltage is applied at the tick after its DRIVE and seen in the SAMPLE after that.",
        voltage,
        needs_arm=True,
    ),
    DeviceCheck("voltage-held", "4", "Without a DRIVE the voltage is held.", held, needs_arm=True),
    DeviceCheck(
        "voltage-limit", "6", "A voltage beyond the limit is clamped; SAMPLE says so.", clamp, needs_arm=True
    ),
    DeviceCheck("slew", "8", "The voltage changes by no more than the slew limit.", slew, needs_arm=True),
    DeviceCheck(
        "corrupt-link",
        "7",
        "Ten corrupt frames among the last 100 lead from RUN to FAULT.",
        corrupt_link,
        needs_arm=True,
    ),
    DeviceCheck("travel-limit", "8", "Travel beyond the limit leads to FAULT.", travel, needs_arm=True),
)
