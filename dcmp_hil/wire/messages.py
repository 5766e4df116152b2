"""The messages of the DBC, field by field."""

from enum import IntEnum
from typing import NamedTuple


class State(IntEnum):
    """State of a device; its amplifier is at 0 V with ENABLE low in all but RUN."""

    BOOT = 0
    IDLE = 1
    ARMING = 2
    RUN = 3
    FAULT = 4


class StopReason(IntEnum):
    """Why a host says STOP."""

    REQUESTED = 0
    SUPERVISOR = 1
    NO_SAMPLE = 2
    PERSON = 3


class Parameter(IntEnum):
    """Parameters of a device, units in their names."""

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
    """Result codes of PARAMETER_SET and PARAMETER_GET."""

    OK = 0
    UNKNOWN = 1
    READ_ONLY = 2
    OUT_OF_RANGE = 3
    NOT_IDLE = 4
    NOT_OWNER = 5


class Stop(NamedTuple):
    """STOP: obeyed from every host, in any session."""

    reason: int  # a StopReason


class Drive(NamedTuple):
    """DRIVE: voltage to apply and the owner's requests, every period."""

    voltage_mV: int  # -32768..32767
    seq: int  # tick modulo 8192 of the SAMPLE that it was computed from
    arm: bool
    clear: bool
    release: bool
    session: int  # 1..65535
    ttl_ms: int  # 5..50


class FaultReport(NamedTuple):
    """FAULT: at a fault, and every 100 ms while it is latched."""

    code: int  # a values.Fault
    tick: int  # low byte of the tick at which it happened
    detail: int


class SampleReport(NamedTuple):
    """SAMPLE: every period, in every state."""

    position_counts: int  # modulo 2**24
    voltage_mV: int  # really applied over the period that ended here
    tick: int  # modulo 256
    state: int  # a State
    missed: bool  # no DRIVE was accepted since the tick before
    limited: bool  # the last command was clamped or slewed
    fault_class: int  # code of the fault, 7 for every code from 7 on


class Edge(NamedTuple):
    """EDGE: the encoder's newest edge, where a board can time-stamp it."""

    position_counts: int
    age_us: int
    tick: int
    direction: int  # -1 or 1


class Hello(NamedTuple):
    """HELLO: who is there; a session other than 0 also asks to own the device."""

    session: int
    protocol_hash: int


class Identity(NamedTuple):
    """IDENTITY: the answer to HELLO."""

    protocol_hash: int
    firmware_version: int  # major * 256 + minor
    busy: bool  # another session owns the device
    owned: bool  # the session of the HELLO owns it
    mismatch: bool  # the hash of the HELLO is not the device's


class ParameterGet(NamedTuple):
    """PARAMETER_GET: a request for the value of a parameter."""

    id: int  # a Parameter


class ParameterSet(NamedTuple):
    """PARAMETER_SET: the owner only, in IDLE only."""

    session: int
    id: int  # a Parameter
    value: int


class ParameterValue(NamedTuple):
    """PARAMETER_VALUE: the present value of a parameter, and a result code."""

    id: int  # a Parameter
    value: int
    result: int  # a ParameterResult


class Health(NamedTuple):
    """HEALTH: counters since boot that stop at 255."""

    crc_errors: int
    sequence_gaps: int
    ring_overruns: int
    bus_offs: int
    late_ticks: int
    idle_percent: int


Message = (
    Stop | Drive | FaultReport | SampleReport | Edge | Hello | Identity
    | ParameterGet | ParameterSet | ParameterValue | Health
)  # fmt: skip
