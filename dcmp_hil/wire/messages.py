# Generated from firmware/proto/dcmp.dbc; `make generate` writes it.
"""Messages of the DBC, field by field."""

from enum import IntEnum
from typing import NamedTuple


class StopReason(IntEnum):
    """Reason for a STOP."""

    REQUESTED = 0
    SUPERVISOR = 1
    NO_SAMPLE = 2
    PERSON = 3


class State(IntEnum):
    """State of a device; its amplifier is at 0 V with ENABLE low in all but RUN."""

    BOOT = 0
    IDLE = 1
    ARMING = 2
    RUN = 3
    FAULT = 4


class Parameter(IntEnum):
    """Parameter of a device, its unit in its name."""

    BOARD = 1
    BOOT_COUNT = 2
    RESET_CAUSE = 3
    TICK = 4
    COUNTS_PER_REV = 5
    PERIOD_US = 6
    VOLTAGE_LIMIT_MV = 7
    SLEW_MV_PER_MS = 8
    WATCHDOG_MS = 9
    SPEED_LIMIT_COUNTS_S = 10
    TRAVEL_LIMIT_COUNTS = 11
    EDGE_STAMPS = 12
    LAST_FAULT = 13
    LAST_FAULT_DETAIL = 14
    SUPPLY_MV = 15
    TRAVEL_ORIGIN_COUNTS = 16


class ParameterResult(IntEnum):
    """Result of a request for a parameter; of several that apply, the first."""

    OK = 0
    UNKNOWN = 1
    READ_ONLY = 2
    OUT_OF_RANGE = 3
    NOT_IDLE = 4
    NOT_OWNER = 5


class Stop(NamedTuple):
    """STOP: stop now; obeyed from every host, in any session."""

    reason: int  # a StopReason


class Drive(NamedTuple):
    """DRIVE: the voltage to apply, every period, from the session that owns the device."""

    voltage_mV: int  # -32768..32767 mV. Raw amplifier millivolts.
    seq: int  # 0..8191 tick. Tick, modulo 8192, of the newest SAMPLE that this command was computed from.
    arm: bool  # Asks to arm, or to stay armed.
    clear: bool  # Asks for the end of FAULT.
    release: bool  # Ends the ownership, and disarms.
    session: int  # 1..65535
    ttl_ms: int  # 5..50 ms. May shorten the watchdog, never lengthen it.


class FaultReport(NamedTuple):
    """FAULT: at a fault, and every 100 ms while it is latched."""

    code: int  # a dcmp_hil.values.Fault
    tick: int  # 0..255 tick. Tick, modulo 256, at which it happened.
    detail: int  # -2147483648..2147483647


class SampleReport(NamedTuple):
    """SAMPLE: every period, from boot on, in every state, to every listener."""

    position_counts: int  # 0..16777215 counts. Raw encoder count modulo 2^24, latched at the tick.
    # -32768..32767 mV. Voltage that was really applied over the period that ended at this tick.
    voltage_mV: int
    tick: int  # 0..255 tick. Periods since boot, modulo 256.
    state: int  # a State
    missed: bool  # No DRIVE was accepted since the tick before.
    limited: bool  # The last command was clamped or slewed.
    fault_class: int  # 0..7. Fault code, 7 for every code from 7 on: FAULT says which.


class Edge(NamedTuple):
    """EDGE: after SAMPLE, once a period, if the parameter EDGE_STAMPS asks for it."""

    position_counts: int  # 0..16777215 counts. Raw encoder count modulo 2^24 at the newest edge.
    age_us: int  # 0..65535 us. Time from the edge to this tick; 65535 for that and more.
    tick: int  # 0..255 tick. As in SAMPLE.
    direction: int  # -1..1. Direction of the count at the edge.


class Hello(NamedTuple):
    """HELLO: ask who is there; a session other than 0 also asks to own the device."""

    session: int  # 0..65535. 0 asks only who is there.
    protocol_hash: int  # 0..4294967295


class Identity(NamedTuple):
    """IDENTITY: the answer to HELLO."""

    protocol_hash: int  # 0..4294967295
    firmware_version: int  # 0..65535. Major * 256 + minor.
    busy: bool  # A session owns the device, another than that of the HELLO.
    owned: bool  # The session of the HELLO owns the device.
    mismatch: bool  # The hash of the HELLO is not the device's.


class ParameterGet(NamedTuple):
    """PARAMETER_GET: ask for a parameter."""

    id: int  # a Parameter


class ParameterSet(NamedTuple):
    """PARAMETER_SET: change a parameter; the owner only, in IDLE only."""

    session: int  # 1..65535
    id: int  # a Parameter
    value: int  # -2147483648..2147483647


class ParameterValue(NamedTuple):
    """PARAMETER_VALUE: the answer to PARAMETER_GET and PARAMETER_SET, with the value that holds now."""

    id: int  # a Parameter
    value: int  # -2147483648..2147483647
    result: int  # a ParameterResult


class Health(NamedTuple):
    """HEALTH: counters since boot that stop at 255, ten times a second."""

    crc_errors: int  # 0..255
    sequence_gaps: int  # 0..255
    ring_overruns: int  # 0..255
    bus_offs: int  # 0..255
    late_ticks: int  # 0..255
    idle_percent: int  # 0..100 %


Message = (
    Stop
    | Drive
    | FaultReport
    | SampleReport
    | Edge
    | Hello
    | Identity
    | ParameterGet
    | ParameterSet
    | ParameterValue
    | Health
)
