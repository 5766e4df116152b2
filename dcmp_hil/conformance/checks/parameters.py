"""Section 9: parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.conformance.check import DeviceCheck
from dcmp_hil.wire.messages import Parameter, ParameterResult, State

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.conformance.client import Client

_VALUE_MAX = 2**31 - 1
_UNSET_TRAVEL_ORIGIN_COUNTS = -1  # TRAVEL_ORIGIN_COUNTS that no session has set
_UNKNOWN_PARAMETERS = (0, 17, 100, 255)
_READ_ONLY = (
    *(Parameter.BOARD, Parameter.BOOT_COUNT, Parameter.RESET_CAUSE, Parameter.TICK),
    *(Parameter.COUNTS_PER_REV, Parameter.PERIOD_US, Parameter.LAST_FAULT, Parameter.LAST_FAULT_DETAIL),
    Parameter.SUPPLY_MV,
)
_LIMITS = (
    Parameter.VOLTAGE_LIMIT_MV,
    Parameter.SPEED_LIMIT_COUNTS_S,
    Parameter.TRAVEL_LIMIT_COUNTS,
)
_RANGES = {
    Parameter.BOARD: (1, _VALUE_MAX),
    Parameter.BOOT_COUNT: (0, _VALUE_MAX),
    Parameter.RESET_CAUSE: (0, 5),
    Parameter.TICK: (0, _VALUE_MAX),
    Parameter.COUNTS_PER_REV: (1, 2**24),
    Parameter.PERIOD_US: (1, 50_000),
    Parameter.VOLTAGE_LIMIT_MV: (1, 32_767),
    Parameter.SLEW_MV_PER_MS: (0, _VALUE_MAX),
    Parameter.WATCHDOG_MS: (5, 50),
    Parameter.SPEED_LIMIT_COUNTS_S: (1, _VALUE_MAX),
    Parameter.TRAVEL_LIMIT_COUNTS: (1, _VALUE_MAX),
    Parameter.EDGE_STAMPS: (0, 1),
    Parameter.LAST_FAULT: (0, 255),
    Parameter.SUPPLY_MV: (0, _VALUE_MAX),
    Parameter.TRAVEL_ORIGIN_COUNTS: (_UNSET_TRAVEL_ORIGIN_COUNTS, 2**24 - 1),
}


def read(client: Client) -> Iterator[str]:
    """Read every parameter."""
    for parameter in Parameter:
        found = client.get(parameter)
        if found is None:
            yield f"PARAMETER_GET {parameter.name} is not answered"
            continue
        if found.result != ParameterResult.OK:
            yield f"{parameter.name} is answered by result {found.result}; every device has it"
        low, high = _RANGES.get(parameter, (-_VALUE_MAX - 1, _VALUE_MAX))
        if not low <= found.value <= high:
            yield f"{parameter.name} is {found.value}, not within {low} .. {high}"


def unknown(client: Client) -> Iterator[str]:
    """Check the answers to requests for parameters that do not exist."""
    session = client.own()
    for number in _UNKNOWN_PARAMETERS:
        for what, found in (
            ("GET", client.get(number)),
            ("SET by the owner", client.put(session, number, 1)),
        ):
            if found is None:
                yield f"PARAMETER {number}: {what} is not answered"
            elif (found.value, found.result) != (0, ParameterResult.UNKNOWN):
                yield (
                    f"PARAMETER {number}: {what} is answered by value {found.value}, result {found.result}; "
                    "it does not exist: value 0, result 1"
                )


def _tried(
    client: Client, session: int, parameter: Parameter, value: int, expected: ParameterResult
) -> Iterator[str]:
    """Set a value and compare what comes of it."""
    before = client.value(parameter)
    found = client.put(session, parameter, value)
    if found is None:
        yield f"PARAMETER_SET {parameter.name} is not answered"
        return
    if found.result != expected:
        yield (
            f"{parameter.name} set to {value} is answered by result {found.result}, the page says "
            f"{expected.value} ({expected.name})"
        )
    now = client.value(parameter)
    ticking = parameter == Parameter.TICK
    if not ticking and found.value != now:
        yield f"{parameter.name} set to {value} is answered by {found.value}, and is {now}"
    if not ticking and now != (value if expected == ParameterResult.OK else before):
        yield f"{parameter.name} was {before}, was set to {value} with {expected.name}, and is {now}"


def read_only(client: Client) -> Iterator[str]:
    """Check that read-only parameters cannot be set."""
    session = client.own()
    for parameter in _READ_ONLY:
        value = client.value(parameter)
        yield from _tried(client, session, parameter, 1 if value != 1 else 2, ParameterResult.READ_ONLY)


def ranges(client: Client) -> Iterator[str]:
    """Lower each limit, raise it again, and try what is outside."""
    session = client.own()
    for parameter in _LIMITS:
        built = client.value(parameter)
        for value, expected in (
            (1, ParameterResult.OK),
            (0, ParameterResult.OUT_OF_RANGE),
            (-1, ParameterResult.OUT_OF_RANGE),
            (-_VALUE_MAX - 1, ParameterResult.OUT_OF_RANGE),
            (max(1, built // 2), ParameterResult.OK),
            (built, ParameterResult.OK),
        ):
            yield from _tried(client, session, parameter, value, expected)
        if built < _VALUE_MAX:
            yield from _tried(client, session, parameter, built + 1, ParameterResult.OUT_OF_RANGE)
            yield from _tried(client, session, parameter, _VALUE_MAX, ParameterResult.OUT_OF_RANGE)
    built = client.value(Parameter.WATCHDOG_MS)
    for value, expected in (
        (5, ParameterResult.OK),
        (4, ParameterResult.OUT_OF_RANGE),
        (built, ParameterResult.OK),
        (built + 1, ParameterResult.OUT_OF_RANGE),
        (51, ParameterResult.OUT_OF_RANGE),
        (-5, ParameterResult.OUT_OF_RANGE),
    ):
        yield from _tried(client, session, Parameter.WATCHDOG_MS, value, expected)
    slew = client.value(Parameter.SLEW_MV_PER_MS)
    yield from _tried(client, session, Parameter.SLEW_MV_PER_MS, 0, ParameterResult.OUT_OF_RANGE)
    yield from _tried(client, session, Parameter.SLEW_MV_PER_MS, 1, ParameterResult.OK)
    if slew:
        yield from _tried(client, session, Parameter.SLEW_MV_PER_MS, slew + 1, ParameterResult.OUT_OF_RANGE)
    else:
        yield from _tried(client, session, Parameter.SLEW_MV_PER_MS, _VALUE_MAX, ParameterResult.OK)
    for value, expected in (
        (0, ParameterResult.OK),
        (2**24, ParameterResult.OUT_OF_RANGE),
        (2**24 - 1, ParameterResult.OK),
        (_UNSET_TRAVEL_ORIGIN_COUNTS - 1, ParameterResult.OUT_OF_RANGE),
        (_UNSET_TRAVEL_ORIGIN_COUNTS, ParameterResult.OK),
    ):
        yield from _tried(client, session, Parameter.TRAVEL_ORIGIN_COUNTS, value, expected)
    yield from _tried(client, session, Parameter.EDGE_STAMPS, 2, ParameterResult.OUT_OF_RANGE)
    yield from _tried(client, session, Parameter.EDGE_STAMPS, 0, ParameterResult.OK)


def owner_only(client: Client) -> Iterator[str]:
    """Set as a stranger; of several reasons the lowest is answered."""
    stranger = client.another_session()
    yield from _tried(client, stranger, Parameter.VOLTAGE_LIMIT_MV, 1, ParameterResult.NOT_OWNER)
    client.own()
    other = client.another_session()
    yield from _tried(client, other, Parameter.VOLTAGE_LIMIT_MV, 1, ParameterResult.NOT_OWNER)
    yield from _tried(client, other, Parameter.VOLTAGE_LIMIT_MV, 0, ParameterResult.OUT_OF_RANGE)
    yield from _tried(client, other, Parameter.PERIOD_US, 0, ParameterResult.READ_ONLY)


def idle_only(client: Client) -> Iterator[str]:
    """Set in FAULT, where STOP leads from IDLE without a motor that moves."""
    session = client.own()
    client.stop()
    if client.settled_state() != State.FAULT:
        yield "STOP does not lead from IDLE to FAULT"
        return
    yield from _tried(client, session, Parameter.VOLTAGE_LIMIT_MV, 1, ParameterResult.NOT_IDLE)
    yield from _tried(
        client, client.another_session(), Parameter.VOLTAGE_LIMIT_MV, 1, ParameterResult.NOT_IDLE
    )
    yield from _tried(client, session, Parameter.VOLTAGE_LIMIT_MV, 0, ParameterResult.OUT_OF_RANGE)


CHECKS = (
    DeviceCheck("parameters-read", "9", "Every parameter is answered, with a value in its range.", read),
    DeviceCheck(
        "parameters-unknown",
        "9",
        "A parameter that does not exist is answered by value 0, UNKNOWN.",
        unknown,
    ),
    DeviceCheck(
        "parameters-read-only",
        "9",
        "A parameter that cannot be set is answered by READ_ONLY and stays.",
        read_only,
    ),
    DeviceCheck(
        "parameters-range",
        "9",
        "A limit can be lowered and raised again up to what the board was built with; nothing else.",
        ranges,
    ),
    DeviceCheck("parameters-owner", "9", "PARAMETER_SET is carried out for the owner only.", owner_only),
    DeviceCheck("parameters-idle", "9", "PARAMETER_SET is carried out in IDLE only.", idle_only),
)
